## The files of an export's folder: never more is read than was promised, and nothing is used whose checksum does not hold.
extends RefCounted

const Check := preload("check.gd")

var folder: String
var check: Check


func _init(from: String, with: Check) -> void:
	folder = from
	check = with


## The content of a file by its checked name, at most so many bytes; exactly so many where `exact`. Empty where check.problem says why.
func content(name: String, most: int, exact: bool) -> PackedByteArray:
	check.file = name
	var path := folder.path_join(name)
	var directory := DirAccess.open(path.get_base_dir())
	if not check.need(directory != null and directory.file_exists(name.get_file()), "", "is missing; choose the folder that reflect export wrote"):
		return PackedByteArray()
	# A link may lead anywhere. Only what is below the chosen folder is the export's.
	var links: bool = directory.is_link(name.get_file()) or (name.contains("/") and DirAccess.open(folder).is_link(name.get_slice("/", 0)))
	if not check.need(not links, "", "is a link, and an export has none"):
		return PackedByteArray()
	var opened := FileAccess.open(path, FileAccess.READ)
	if not check.need(opened != null, "", "cannot be read"):
		return PackedByteArray()
	var length := opened.get_length()
	if exact:
		check.need(length == most, "bytes", "are %d where the manifest says %d" % [length, most])
	else:
		check.need(length <= most, "bytes", "are %d, more than the %d that are taken" % [length, most])
	if check.problem:
		return PackedByteArray()
	var found := opened.get_buffer(length)
	check.need(found.size() == length, "", "cannot be read to its end")
	return found if check.problem.is_empty() else PackedByteArray()


## The content of an entry of the manifest, whose SHA-256 holds.
func promised(entry: Dictionary) -> PackedByteArray:
	var found := content(entry.file, int(entry.bytes), true)
	if check.problem:
		return found
	var context := HashingContext.new()
	context.start(HashingContext.HASH_SHA256)
	context.update(found)
	var same: bool = context.finish().hex_encode() == entry.sha256
	return found if check.need(same, "sha256", "is not the manifest's, so the file was changed or damaged") else PackedByteArray()


## A kernel in Godot's language. It may hold functions and their guards, nothing that reads other files or declares what this program declares.
func kernel(entry: Dictionary) -> String:
	var bytes := promised(entry.godot)
	var found := bytes.get_string_from_ascii()
	var foreign := RegEx.create_from_string("#\\s*(include|pragma)|\\b(shader_type|render_mode|uniform|global|varying|group_uniforms)\\b").search(found)
	if check.problem.is_empty():
		check.need(foreign == null and not found.is_empty(), "", "is no kernel")
	return found if check.problem.is_empty() else ""
