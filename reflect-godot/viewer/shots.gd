## Pictures for tests: the export's first picture by each method, as the window shows it, and what that took. Ends the program; status 1 after a sentence.
extends RefCounted


static func draw(viewer: Node3D, wishes: Dictionary) -> void:
	var problem: String = await _draw(viewer, wishes)
	if problem:
		printerr(problem)
	viewer.get_tree().quit(1 if problem else 0)


static func _draw(viewer: Node3D, wishes: Dictionary) -> String:
	var window := viewer.get_window()
	var told := {}
	var start := Time.get_ticks_msec()
	if not viewer.open(wishes.get("export", ""), int(wishes.get("rays", "1"))):
		return viewer.check.problem
	told["opened_ms"] = Time.get_ticks_msec() - start
	var picture: Dictionary = viewer.reflections.manifest.pictures[0] if viewer.reflections.manifest.pictures else {}
	if picture.is_empty():
		return "reflect.json: pictures are none; export with --size."
	window.size = Vector2i(int(picture.width), int(picture.height))
	window.transparent_bg = true  # 8 bits a channel at once, not 10 first
	if wishes.get("pose"):
		var numbers: PackedFloat64Array = wishes.pose.split_floats(",")
		viewer.reflections.scene.root.transform = Transform3D(Basis.from_euler(Vector3(numbers[3], numbers[4], numbers[5])) * numbers[6], Vector3(numbers[0], numbers[1], numbers[2]))
	if wishes.get("view", "compare") == "compare" and not viewer.compare(true):
		return viewer.check.problem
	for method: String in wishes.method.split(",") if wishes.has("method") else viewer.reflections.methods():
		start = Time.get_ticks_msec()
		if not viewer.show_method(method):
			return viewer.check.problem
		var loaded := Time.get_ticks_msec()
		await RenderingServer.frame_post_draw  # the one that was under way
		await RenderingServer.frame_post_draw
		var image := window.get_texture().get_image()
		told[method] = {"loaded_ms": loaded - start, "drawn_ms": Time.get_ticks_msec() - loaded, "megabytes": viewer.reflections.megabytes(), "size": [image.get_width(), image.get_height()]}
		image.convert(Image.FORMAT_RGB8)
		if image.save_png(wishes.out.path_join(method + ".png")) != OK:
			return wishes.out + ": cannot be written."
	FileAccess.open(wishes.out.path_join("drawn.json"), FileAccess.WRITE).store_string(JSON.stringify(told, " "))
	return ""
