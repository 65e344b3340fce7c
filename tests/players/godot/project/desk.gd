extends SceneTree
## Plays a job: a JSON list of [command, arguments...]; each command is a function below. Pictures go into the job's
## folder as raw numbers, what is said about them and all other answers into answers.json.

const ADDON := "res://addons/gaussian_avatar/"


class Counting:
	extends CompositorEffect
	## A user's own effect: it counts its calls.
	var calls := 0

	func _init() -> void:
		effect_callback_type = EFFECT_CALLBACK_TYPE_POST_TRANSPARENT

	func _render_callback(_type: int, _data: RenderData) -> void:
		calls += 1


var folder: String
var answers := {}
var lag := 0  # frames until what is set is seen: a separate render thread lags behind
var named := {}  # nodes, compositors and effects of the job
var world := Node3D.new()
var surroundings := WorldEnvironment.new()
var camera := Camera3D.new()


func _initialize() -> void:
	_play.call_deferred(OS.get_cmdline_user_args()[0])


func _play(path: String) -> void:
	folder = path.get_base_dir()
	surroundings.environment = Environment.new()
	surroundings.environment.background_mode = Environment.BG_COLOR
	surroundings.environment.ambient_light_source = Environment.AMBIENT_SOURCE_DISABLED
	world.add_child(surroundings)
	world.add_child(camera)
	root.add_child(world)
	camera.make_current()
	for command: Array in JSON.parse_string(FileAccess.get_file_as_string(path)):
		await callv(command[0], command.slice(1))
	FileAccess.open(folder.path_join("answers.json"), FileAccess.WRITE).store_string(JSON.stringify(answers, "", true, true))
	world.free()
	named.clear()
	await process_frame
	quit()


func lags(count: int) -> void:
	lag = count


func background(r: float, g: float, b: float) -> void:
	surroundings.environment.background_color = Color(r, g, b)


func look(at: Array, fov: float, width: int, height: int) -> void:
	_look(camera, at, fov)
	if root.size != Vector2i(width, height):
		root.size = Vector2i(width, height)
		await RenderingServer.frame_post_draw


func _look(by: Camera3D, at: Array, fov: float) -> void:
	by.global_transform = _transform(at)
	by.set_perspective(fov, 0.01, 100.0)


## Until it looks again, the main camera looks through a window beside its axis, or sees all in its true size.
func frustum(size: float, x: float, y: float) -> void:
	camera.set_frustum(size, Vector2(x, y), 0.01, 100.0)


func orthogonal(size: float) -> void:
	camera.set_orthogonal(size, 0.01, 100.0)


## Sets a property of the main viewport.
func viewport(property: String, value: Variant) -> void:
	root.set(property, value)


func avatar(name: String, pack: String, at: Array) -> void:
	var resource: Resource = load(ADDON + "gaussian_avatar.gd").new()
	resource.name = name
	resource.data = FileAccess.get_file_as_bytes(pack)
	var node: Node3D = load(ADDON + "gaussian_avatar_3d.gd").new()
	node.avatar = resource
	node.level = 0
	_put(name, node, at)


func pose(name: String, weights: Array, eyelids: Array, joints: Array, at: Array) -> void:
	var core: RefCounted = named[name].core
	for i in weights.size():
		core.set_expression(i, weights[i])
	for i in eyelids.size():
		core.set_eyelid(i, eyelids[i])
	for i in joints.size():
		core.set_joint(i, _transform(joints[i]))
	core.set_root(_transform(at))
	core.commit()


func box(name: String, at: Array, size: Array, colour: Array, shaded: bool) -> void:
	var node := MeshInstance3D.new()
	node.mesh = BoxMesh.new()
	node.mesh.size = Vector3(size[0], size[1], size[2])
	var material := StandardMaterial3D.new()
	material.albedo_color = Color(colour[0], colour[1], colour[2])
	material.shading_mode = BaseMaterial3D.SHADING_MODE_PER_PIXEL if shaded else BaseMaterial3D.SHADING_MODE_UNSHADED
	node.material_override = material
	_put(name, node, at)


func light(name: String, at: Array, kind := "DirectionalLight3D", properties := {"shadow_enabled": true}) -> void:
	var node: Light3D = ClassDB.instantiate(kind)
	_set_all(node, properties)
	_put(name, node, at)


## White and matt.
func ball(name: String, at: Array, radius: float) -> void:
	var node := MeshInstance3D.new()
	node.mesh = SphereMesh.new()
	_set_all(node.mesh, {"radius": radius, "height": 2 * radius, "radial_segments": 256, "rings": 128})
	node.material_override = StandardMaterial3D.new()
	_set_all(node.material_override, {"diffuse_mode": BaseMaterial3D.DIFFUSE_LAMBERT, "roughness": 1.0, "metallic_specular": 0.0})
	_put(name, node, at)


func ambient(properties: Dictionary) -> void:
	_set_all(surroundings.environment, properties)


## A sky of rows of colours, for ambient light alone.
func sky(rows: Array, turn: Array) -> void:
	var image := Image.create_empty(rows[0].size(), rows.size(), false, Image.FORMAT_RGBF)
	for y in rows.size():
		for x in rows[y].size():
			image.set_pixel(x, y, _colour(rows[y][x]))
	var made := Sky.new()
	made.sky_material = PanoramaSkyMaterial.new()
	made.sky_material.panorama = ImageTexture.create_from_image(image)
	ambient({"sky": made, "ambient_light_source": Environment.AMBIENT_SOURCE_SKY})
	surroundings.environment.sky_rotation = Vector3(turn[0], turn[1], turn[2])


## Takes the environment away.
func bare() -> void:
	surroundings.environment = null


func change(name: String, properties: Dictionary) -> void:
	_set_all(named[name], properties)


## Puts the middle of an avatar where the world's is.
func centre(name: String) -> void:
	named[name].position -= named[name].middle()


## The light that an avatar's node has handed on.
func shone(name: String, of: String) -> void:
	answers["light " + name] = Array(named[of]._light)


func _set_all(of: Object, properties: Dictionary) -> void:
	for property: String in properties:
		var value: Variant = properties[property]
		of.set(property, _colour(value) if value is Array else value)


func _colour(of: Array) -> Color:
	return Color(of[0], of[1], of[2])


func place(name: String, at: Array) -> void:
	named[name].transform = _transform(at)


func show(name: String, visible: bool) -> void:
	named[name].visible = visible


func remove(name: String) -> void:
	named[name].free()
	named.erase(name)


func _put(name: String, node: Node3D, at: Array) -> void:
	node.transform = _transform(at)
	named[name] = node
	world.add_child(node)


## A compositor of the user with an effect that counts its calls, on "environment" or "camera"; "" takes both away.
func compositor(name: String, on: String) -> void:
	if on == "":
		surroundings.compositor = null
		camera.compositor = null
		return
	named[name] = Counting.new()
	var own := Compositor.new()
	own.compositor_effects = [named[name]]
	(surroundings if on == "environment" else camera).compositor = own


func calls(name: String, of: String) -> void:
	answers["calls " + name] = named[of].calls


## A viewport of its own with a camera of its own, in the same world.
func subviewport(name: String, at: Array, fov: float, width: int, height: int) -> void:
	var made := SubViewport.new()
	var eye := Camera3D.new()
	made.size = Vector2i(width, height)
	made.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	made.add_child(eye)
	world.add_child(made)
	_look(eye, at, fov)
	eye.make_current()
	named[name] = made


## What the main viewport shows after some frames, and what our effect accumulated.
func shot(name: String, frames := 1) -> void:
	for i in frames + lag:
		await RenderingServer.frame_post_draw
	_save(name, root, camera)
	if _effect() != null:
		accumulated(name)


func shot_of(name: String, of: String) -> void:
	for i in 1 + lag:
		await RenderingServer.frame_post_draw
	_save(name, named[of], named[of].get_camera_3d())


func accumulated(name: String) -> void:
	var image := {}
	var effect := _effect()
	RenderingServer.call_on_render_thread(func() -> void: image.merge(effect.accumulated()))
	RenderingServer.force_sync()
	answers["accumulated " + name] = [image.width, image.height]
	FileAccess.open(folder.path_join(name + ".accumulated"), FileAccess.WRITE).store_buffer(image.data)


func statistics(name: String) -> void:
	RenderingServer.force_sync()
	answers["statistics " + name] = _effect().statistics()
	answers["error " + name] = _effect().error()


## Each frame another pose.
func frames(name: String, count: int) -> void:
	for i in count:
		named[name].core.set_root(Transform3D(Basis(), Vector3(0.001 * (i % 7), 0, 0)))
		named[name].core.commit()
		await RenderingServer.frame_post_draw


## What frames cost: milliseconds a frame of the CPU, all threads, and of the wall. Each has the next of the poses, if any.
func cost(name: String, count: int, poses: Array) -> void:
	await RenderingServer.frame_post_draw
	root.get_texture().get_image()  # waits for the GPU
	var wall := Time.get_ticks_usec()
	var cpu := _cpu_ms()
	for i in count:
		if not poses.is_empty():
			pose.callv(poses[i % poses.size()])
		await RenderingServer.frame_post_draw
	root.get_texture().get_image()
	answers["cost " + name] = [(_cpu_ms() - cpu) / count, 0.001 * (Time.get_ticks_usec() - wall) / count]
	answers["adapter"] = RenderingServer.get_video_adapter_name() + ", " + RenderingServer.get_video_adapter_api_version()


func _cpu_ms() -> float:
	var said := FileAccess.open("/proc/self/stat", FileAccess.READ).get_line().get_slice(") ", 1).split(" ")
	return 10.0 * (said[11].to_int() + said[12].to_int())  # user and system time, in hundredths of a second


## Makes and frees a node as often as that, and shows each.
func again(pack: String, count: int) -> void:
	for i in count:
		avatar("again", pack, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0])
		await RenderingServer.frame_post_draw
		remove("again")
	await RenderingServer.frame_post_draw


func conform(name: String, of: String, pack: String, cases: String, vectors: String) -> void:
	var core: RefCounted = load(ADDON + "gaussian_avatar.gd").make_core()
	var said: String = core.load(FileAccess.get_file_as_bytes(of.path_join(pack)), pack)
	var text := FileAccess.get_file_as_string(of.path_join(cases))
	answers["conform " + name] = (
		{"error": said, "rows": []} if said else core.conform(text, FileAccess.get_file_as_bytes(of.path_join(vectors)))
	)


func _save(name: String, of: Viewport, through: Camera3D) -> void:
	var at := through.get_camera_transform()
	var lens := through.get_camera_projection()
	answers["camera " + name] = [at.basis.x, at.basis.y, at.basis.z, at.origin, lens.x, lens.y, lens.z, lens.w].map(
		func(column: Variant) -> Array: return range(4 if column is Vector4 else 3).map(func(i: int) -> float: return column[i])
	)
	var image := of.get_texture().get_image()
	var is_linear := image.get_format() >= Image.FORMAT_RF
	image.convert(Image.FORMAT_RGBAF if is_linear else Image.FORMAT_RGBA8)
	answers["viewport " + name] = [image.get_width(), image.get_height(), is_linear]
	FileAccess.open(folder.path_join(name + ".viewport"), FileAccess.WRITE).store_buffer(image.get_data())


func _effect() -> CompositorEffect:
	for node: Object in named.values():
		if node is Node and "core" in node:
			return load(ADDON + "worlds.gd").effect_of(node)
	return null


## A transform of 12 numbers, row by row.
func _transform(m: Array) -> Transform3D:
	return Transform3D(
		Vector3(m[0], m[4], m[8]), Vector3(m[1], m[5], m[9]), Vector3(m[2], m[6], m[10]), Vector3(m[3], m[7], m[11])
	)
