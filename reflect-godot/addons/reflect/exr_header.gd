## The header of an EXR, held against the manifest before Godot's decoder takes memory for it [OpenEXR, "Technical Introduction"]: scan lines in one part, ZIP,
## all channels alike and whole, a data window that begins at 0, no attribute twice.
extends RefCounted

const Check := preload("check.gd")

const MAGIC := 20000630
const MOST := 65536  # bytes that a header is looked for in
const TYPES := {1: "half", 2: "float"}
const ZIP := 3


## Whether the file's header says this; check.problem else. channels: in the file's order, the alphabet's.
static func agrees(bytes: PackedByteArray, width: int, height: int, type: String, channels: String, check: Check) -> bool:
	if not check.need(bytes.size() > 64 and bytes.decode_u32(0) == MAGIC and bytes.decode_u32(4) == 2, "", "is no EXR of one picture in rows"):
		return false
	var found := _attributes(bytes, check)
	for name: String in ["channels chlist", "dataWindow box2i", "compression compression", "lineOrder lineOrder"]:
		if not check.need(found.has(name), "the header", "has no " + name.get_slice(" ", 0)):
			return false
	var window: PackedByteArray = found["dataWindow box2i"]
	var size := [0, 4, 8, 12].map(func(at: int) -> int: return window.decode_s32(at) if window.size() == 16 else -1)
	check.need(size == [0, 0, width - 1, height - 1], "the header's dataWindow", "is %s where the manifest says %d x %d" % [size, width, height])
	check.need(found["compression compression"] == PackedByteArray([ZIP]), "the header's compression", "is not ZIP")
	check.need(found["lineOrder lineOrder"] == PackedByteArray([0]), "the header's lineOrder", "is not increasing")
	var said := _channels(found["channels chlist"])
	check.need(said == "%s of %s" % [channels, type], "the header's channels", "are %s in place of %s of %s" % [said, channels, type])
	return check.problem.is_empty()


## "name type" -> value.
static func _attributes(bytes: PackedByteArray, check: Check) -> Dictionary:
	var found := {}
	var names := {}
	var at := 8
	var end := mini(bytes.size(), MOST)
	while at < end and bytes[at] != 0:
		var words := []
		for k in 2:
			var stop := bytes.find(0, at)
			if stop < 0 or stop >= end or stop - at > 255:
				check.refuse("the header", "has no end")
				return {}
			words.append(bytes.slice(at, stop).get_string_from_ascii())
			at = stop + 1
		var size := bytes.decode_u32(at) if at + 4 <= end else MOST
		if not check.need(at + 4 + size < end, "the header", "has no end") or not check.need(not names.has(words[0]), "the header", "says %s twice" % words[0]):
			return {}
		names[words[0]] = true
		found[" ".join(words)] = bytes.slice(at + 4, at + 4 + size)
		at += 4 + size
	return found


## "ABGR of half"; something else for what is not alike.
static func _channels(value: PackedByteArray) -> String:
	var names := ""
	var types := {}
	var at := 0
	while at < value.size() and value[at] != 0:
		var stop := value.find(0, at)
		if stop < 0 or stop + 17 > value.size() or value.decode_u32(stop + 9) != 1 or value.decode_u32(stop + 13) != 1:
			return "of a kind that no export has"
		names += value.slice(at, stop).get_string_from_ascii()
		types[TYPES.get(int(value.decode_u32(stop + 1)), "other numbers")] = true
		at = stop + 17
	return "%s of %s" % [names, " and ".join(types.keys())]
