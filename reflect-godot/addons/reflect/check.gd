## What an export may not say. The first thing that is wrong is kept as one sentence that names the file and the field; what is asked afterwards is answered
## with something empty, so that callers look at `problem` once, at the end.
extends RefCounted

const SIDE := 16384  # texels
const MOST_FLOAT := 3.4e38
const ENTRIES := 65536  # of any table or list
const DIGITS := 12  # of a content's SHA-256 that its file's name holds

var file := "reflect.json"
var problem := ""


## Keeps the sentence; false, for `return refuse(...)`.
func refuse(field: String, what: String) -> bool:
	if problem.is_empty():
		problem = "%s: %s%s%s." % [file, field.left(120), " " if field else "", what]
	return false


func need(holds: bool, field: String, what: String) -> bool:
	return holds or refuse(field, what)


func table(value: Variant, field: String) -> Dictionary:
	if not need(value is Dictionary, field, "is not a table"):
		return {}
	return value if need(value.size() <= ENTRIES, field, "has more than %d entries" % ENTRIES) else {}


## A table with exactly these fields; empty where it is none.
func record(value: Variant, field: String, names: Array) -> Dictionary:
	var found := table(value, field)
	if problem:
		return {}
	for key: String in found:
		need(key in names, field, 'has a field "%s" that no manifest has' % key.left(40))
	for name: String in names:
		need(found.has(name), field, "has no field " + name)
	return found if problem.is_empty() else {}


func list(value: Variant, field: String, length := -1) -> Array:
	if not need(value is Array, field, "is not a list"):
		return []
	need(value.size() <= ENTRIES, field, "has more than %d entries" % ENTRIES)
	need(length < 0 or value.size() == length, field, "has %d entries in place of %d" % [value.size(), length])
	return value if problem.is_empty() else []


func text(value: Variant, field: String, most := 1024) -> String:
	if not need(value is String, field, "is not a text"):
		return ""
	return value if need(value.length() <= most, field, "is longer than %d characters" % most) else ""


func word(value: Variant, field: String) -> String:
	return value if need(value is String and _fits(value, "^[A-Za-z][A-Za-z0-9_]{0,79}$"), field, "is not a word of letters, digits and _") else ""


func number(value: Variant, field: String, least := -MOST_FLOAT, most := MOST_FLOAT) -> float:
	if not need((value is float or value is int) and is_finite(value), field, "is not a finite number"):
		return 0.0
	return value if need(value >= least and value <= most, field, "is %s and not between %s and %s" % [value, least, most].map(func(n: float) -> String: return String.num_scientific(n))) else 0.0


func numbers(value: Variant, field: String, length: int, least := -MOST_FLOAT) -> void:
	for one: Variant in list(value, field, length):
		number(one, field, least)


func whole(value: Variant, field: String, least: int, most: int) -> int:
	var found := number(value, field)
	need(found == floorf(found), field, "is %s and not a whole number" % String.num_scientific(found))
	return int(number(value, field, least, most)) if problem.is_empty() else 0


## An entry of a table by its id.
func entry(entries: Dictionary, id: Variant, field: String) -> Variant:
	var key := text(id, field)
	return entries[key] if need(entries.has(key), field, 'names "%s", which is not there' % key.left(40)) else null


## The name of a file in one of the export's folders: no way out of it.
## endings: without their dot, "exr|ktx2".
func file_name(value: Variant, field: String, folder: String, endings: String) -> String:
	var name := text(value, field, 255)
	var fits := _fits(name, "^%s/[A-Za-z0-9_~-]{1,160}\\.(%s)$" % [folder, endings])
	var said := endings.replace("|", " or .")
	return name if need(fits, field, 'is "%s", which is no plain name in %s/ that ends with .%s' % [name.left(60), folder, said]) else ""


## The checksum of a file, whose name holds its beginning.
func checksum(value: Variant, field: String, named := "") -> void:
	if need(value is String and _fits(value, "^[0-9a-f]{64}$"), field, "is not a SHA-256 in 64 small hexadecimal digits") and named:
		need(named.get_basename().ends_with(value.left(DIGITS)), field, "is not the one that the file's name begins")


func _fits(value: String, pattern: String) -> bool:
	return RegEx.create_from_string(pattern).search(value) != null
