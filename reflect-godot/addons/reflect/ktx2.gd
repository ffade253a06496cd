## A float image as KTX2: one picture without mips, RGBA halfs or floats, as it is or by Zstandard [Khronos, "KTX File Format Specification 2.0", 3]. Its header is
## held against the manifest before memory is taken.
extends RefCounted

const Check := preload("check.gd")

const MAGIC := [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a]
const HEAD := 104  # bytes, with one level
const FORMATS := {97: Image.FORMAT_RGBAH, 109: Image.FORMAT_RGBAF}
const ZSTANDARD := 2


## The picture, top row first; null where check.problem says why.
static func image(bytes: PackedByteArray, width: int, height: int, floats: bool, check: Check) -> Image:
	var wanted := 109 if floats else 97
	var size := width * height * (16 if floats else 8)
	if not check.need(bytes.size() > HEAD and bytes.slice(0, 12) == PackedByteArray(MAGIC), "", "is no KTX2"):
		return null
	var said: Array = range(12, 48, 4).map(func(at: int) -> int: return bytes.decode_u32(at))
	check.need(said[0] == wanted, "the header's vkFormat", "is %d, not %d" % [said[0], wanted])
	check.need(said[2] == width and said[3] == height, "the header's size", "is %d x %d where the manifest says %d x %d" % [said[2], said[3], width, height])
	check.need(said.slice(4, 8) == [0, 0, 1, 1], "the header", "is not of one picture")
	check.need(said[8] in [0, ZSTANDARD], "the header's supercompressionScheme", "is neither 0 nor Zstandard's 2")
	var start := bytes.decode_s64(80)
	var length := bytes.decode_s64(88)
	check.need(bytes.decode_s64(96) == size, "the level's uncompressedByteLength", "is not that of its texels")
	check.need(start >= HEAD and length > 0 and length <= bytes.size() and start <= bytes.size() - length, "the level", "lies outside of the file")
	check.need(said[8] == ZSTANDARD or length == size, "the level", "does not hold its texels")
	if check.problem:
		return null
	var level := bytes.slice(start, start + length)
	if said[8] == ZSTANDARD:
		level = level.decompress(size, FileAccess.COMPRESSION_ZSTD)  # never more than this
	if not check.need(level.size() == size, "the level", "does not unpack to its texels"):
		return null
	return Image.create_from_data(width, height, false, FORMATS[wanted], level)
