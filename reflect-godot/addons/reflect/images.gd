## An export's images as textures: texels as they are, no colour space, no mips, row 0 the bottom row of the picture.
extends RefCounted

const Check := preload("check.gd")
const ExrHeader := preload("exr_header.gd")
const Ktx2 := preload("ktx2.gd")

const DDS_HEADER := 128
const DXT1 := 0x31545844


## The texture of an image's entry; null where check.problem says why.
static func texture_of(bytes: PackedByteArray, entry: Dictionary, check: Check) -> ImageTexture:
	var image: Image
	if entry.kind == "bc1":
		image = _blocks(bytes, entry, check)
	else:
		var floats: bool = entry.kind == "buf"
		if entry.file.ends_with(".ktx2"):
			image = Ktx2.image(bytes, int(entry.width), int(entry.height), floats, check)
		else:
			image = _exr(bytes, int(entry.width), int(entry.height), floats, "ABGR", check)
		if image:
			image.flip_y()
	return ImageTexture.create_from_image(image) if image else null


## The picture that stands behind reflections, top row first as Godot counts a screen's.
static func behind(bytes: PackedByteArray, width: int, height: int, check: Check) -> ImageTexture:
	var image := _exr(bytes, width, height, false, "BGR", check)
	return ImageTexture.create_from_image(image) if image else null


static func _exr(bytes: PackedByteArray, width: int, height: int, floats: bool, channels: String, check: Check) -> Image:
	if not ExrHeader.agrees(bytes, width, height, "float" if floats else "half", channels, check):
		return null
	var image := Image.new()
	var read := image.load_exr_from_buffer(bytes) == OK and image.get_size() == Vector2i(width, height)
	var formats := [Image.FORMAT_RGBAF, Image.FORMAT_RGBF] if floats else [Image.FORMAT_RGBAH, Image.FORMAT_RGBH]
	return image if check.need(read and image.get_format() in formats, "", "cannot be decoded") else null


## Blocks go to the graphics card as they are, where it reads them; they are turned over by whole rows of blocks, and the rows within each.
static func _blocks(bytes: PackedByteArray, entry: Dictionary, check: Check) -> Image:
	var width := int(entry.width)
	var height := int(entry.height)
	var fits := bytes.size() == DDS_HEADER + width * height / 2 and bytes.slice(0, 4).get_string_from_ascii() == "DDS "
	fits = fits and bytes.decode_u32(4) == 124 and bytes.decode_u32(76) == 32 and bytes.decode_u32(84) == DXT1 and bytes.decode_u32(28) <= 1
	fits = fits and bytes.decode_u32(12) == height and bytes.decode_u32(16) == width
	if not check.need(fits, "the header", "is not that of %d x %d texels of DXT1 without mipmaps" % [width, height]):
		return null
	var turned := PackedByteArray()
	turned.resize(bytes.size() - DDS_HEADER)
	var columns := width / 4
	var rows := height / 4
	for row in rows:
		var from := DDS_HEADER + 8 * columns * (rows - 1 - row)
		var to := 8 * columns * row
		for block in columns:
			turned.encode_u32(to, bytes.decode_u32(from))
			var codes := bytes.decode_u32(from + 4)
			turned.encode_u32(to + 4, (codes >> 24) | ((codes >> 8) & 0xff00) | ((codes & 0xff00) << 8) | ((codes & 0xff) << 24))
			from += 8
			to += 8
	var image := Image.create_from_data(width, height, false, Image.FORMAT_DXT1, turned)
	if not RenderingServer.has_os_feature("s3tc"):
		image.decompress()
	return image
