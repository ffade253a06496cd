## A camera that goes round a point: drag, wheel, arrow keys and + and -.
extends Camera3D

const STEP := 0.08  # rad a key press
const KEYS := {KEY_LEFT: Vector2(-STEP, 0), KEY_RIGHT: Vector2(STEP, 0), KEY_UP: Vector2(0, -STEP), KEY_DOWN: Vector2(0, STEP)}
const ZOOMS := {KEY_PLUS: 0.9, KEY_EQUAL: 0.9, KEY_KP_ADD: 0.9, KEY_MINUS: 1 / 0.9, KEY_KP_SUBTRACT: 1 / 0.9}
const WHEEL := {MOUSE_BUTTON_WHEEL_UP: 0.9, MOUSE_BUTTON_WHEEL_DOWN: 1 / 0.9}

var target := Vector3.ZERO


## Looks at a box as `from` does, or from aside where there is none.
func show_all(box: AABB, from: Camera3D) -> void:
	var size := maxf(box.size.length(), 1e-3)
	near = size / 5000
	far = size * 20
	if from:
		position = from.position
		var ahead := -from.transform.basis.z
		target = position + ahead * maxf((box.get_center() - position).dot(ahead), 0.05 * size)
		if from.projection == PROJECTION_FRUSTUM:
			fov = rad_to_deg(2 * atan(from.size / (2 * from.near)))
	else:
		target = box.get_center()
		position = target + size * Vector3(0.6, 0.4, 0.9)
	look_at(target)


func turn(by: Vector2, zoom := 1.0) -> void:
	var away := position - target
	var angles := Vector2(atan2(away.x, away.z) + by.x, clampf(acos(clampf(away.y / away.length(), -1, 1)) + by.y, 0.01, PI - 0.01))
	var radius := away.length() * zoom
	position = target + radius * Vector3(sin(angles.y) * sin(angles.x), cos(angles.y), sin(angles.y) * cos(angles.x))
	look_at(target)


func _unhandled_input(event: InputEvent) -> void:
	if not current:
		return
	if event is InputEventMouseMotion and event.button_mask & MOUSE_BUTTON_MASK_LEFT:
		turn(-event.relative * 0.005)
	elif event is InputEventMouseButton and event.pressed and WHEEL.has(event.button_index):
		turn(Vector2.ZERO, WHEEL[event.button_index])
	elif event is InputEventKey and event.pressed and (KEYS.has(event.keycode) or ZOOMS.has(event.keycode)):
		turn(KEYS.get(event.keycode, Vector2.ZERO), ZOOMS.get(event.keycode, 1.0))
