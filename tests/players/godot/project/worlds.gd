extends SceneTree
## Whether our effect and the user's are called in each frame, whatever Compositors are set. Prints one line of JSON.

const Worlds := preload("res://addons/gaussian_avatar/worlds.gd")
const Counting := preload("res://counting.gd")
const FRAMES := 3

var avatar: GaussianAvatar3D
var camera := Camera3D.new()
var environment := WorldEnvironment.new()
var users: Array[Counting] = []
var told := {}


func _initialize() -> void:
	await process_frame
	avatar = (load("res://right.avatar") as PackedScene).instantiate()
	root.add_child(avatar)
	camera.position.z = 2
	root.add_child(camera)
	await told_after("alone", func() -> void: pass)
	await told_after("world", func() -> void: environment.compositor = user(); root.add_child(environment))
	await told_after("world_and_camera", func() -> void: camera.compositor = user())
	await told_after("list_changed", func() -> void: camera.compositor.compositor_effects = [effect(), effect()])
	await told_after("same_list_again", func() -> void: camera.compositor.compositor_effects = camera.compositor.compositor_effects)
	await told_after("camera_gone", func() -> void: camera.compositor = null)
	await told_after("other_camera", func() -> void: other_camera())
	await told_after("first_camera", func() -> void: camera.make_current())
	await told_after("world_gone", func() -> void: environment.compositor = null)
	await told_after("world_again", func() -> void: environment.compositor = user())
	await told_after("node_gone", func() -> void: root.remove_child(environment))
	await told_after("node_again", func() -> void: root.add_child(environment); camera.compositor = user())
	await told_after("avatar_gone", func() -> void: root.remove_child(avatar))
	await told_after("avatar_again", func() -> void: root.add_child(avatar))
	camera.compositor = null
	environment.compositor = null
	await told_after("four_views", func() -> void: views(3))
	for view in root.find_children("View*", "", false, false):
		view.free()
	await own_world()
	await shared()
	await life()
	avatar.free()
	await process_frame
	environment.free()
	camera.free()
	users.clear()
	print("RESULT ", JSON.stringify(told))
	quit()


func effect() -> Counting:
	var made := Counting.new()
	users.append(made)
	return made


func user() -> Compositor:
	var made := Compositor.new()
	made.compositor_effects = [effect()]
	return made


func views_of(node: GaussianAvatar3D) -> int:
	var ours := Worlds.effect_of(node)
	return ours.call(&"statistics")["views"] if ours != null else 0


## How often ours and each of the user's were called in a frame.
func told_after(what: String, change: Callable) -> void:
	change.call()
	await process_frame
	await process_frame
	var ours := views_of(avatar)
	for one in users:
		one.calls = 0
	for i in FRAMES:
		await process_frame
	var now := views_of(avatar)
	told[what] = [(now - ours) / float(FRAMES), users.map(func(one: Counting) -> float: return one.calls / float(FRAMES))]


func other_camera() -> void:
	var other := Camera3D.new()
	other.name = "Other"
	other.compositor = user()
	root.add_child(other)
	other.make_current()


func views(count: int) -> void:
	for i in count:
		view("View%d" % i)


func view(called: String) -> SubViewport:
	var made := SubViewport.new()
	made.name = called
	made.size = Vector2i(64, 64)
	made.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	made.add_child(Camera3D.new())
	root.add_child(made)
	return made


## An avatar in a viewport with a world of its own, and one that changes its world.
func own_world() -> void:
	var made := view("Own")
	made.own_world_3d = true
	var other: GaussianAvatar3D = avatar.duplicate()
	made.add_child(other)
	await process_frame
	await process_frame
	var before := [views_of(avatar), views_of(other)]
	await process_frame
	told["own_world"] = [views_of(avatar) - before[0], views_of(other) - before[1]]
	told["two_effects"] = Worlds.effect_of(other) != Worlds.effect_of(avatar)
	other.reparent(root)
	await process_frame
	told["one_effect"] = Worlds.effect_of(other) == Worlds.effect_of(avatar)
	other.free()
	made.free()


## Bytes of the GPU's buffers that a first node takes, and a second one of the same file.
func shared() -> void:
	var bytes := []
	var other: GaussianAvatar3D = avatar.duplicate()
	root.remove_child(avatar)
	for node: Node in [null, avatar, other]:
		if node != null:
			root.add_child(node)
		await process_frame
		await process_frame
		bytes.append(RenderingServer.get_rendering_info(RenderingServer.RENDERING_INFO_BUFFER_MEM_USED))
	told["shared"] = [bytes[1] - bytes[0], bytes[2] - bytes[1]]
	other.free()


## Hidden, scaled, freed and made again, many times.
func life() -> void:
	avatar.visible = false
	for i in 100:
		var one: GaussianAvatar3D = avatar.duplicate()
		one.visible = i % 2 == 0
		root.add_child(one)
		one.set("expressions/jaw/jawOpen", 1.0)
		if i % 10 == 0:
			await process_frame
		if i % 3 == 0:
			root.remove_child(one)
			root.add_child(one)
		one.free()
	await process_frame
	told["shown"] = Worlds.effect_of(avatar).call(&"error")
