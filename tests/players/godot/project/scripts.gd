extends SceneTree
## What the scripts of the add-on do without a display. Prints one line of JSON.

const PORT_TRIES := 50
const Properties := preload("res://addons/gaussian_avatar/pose_properties.gd")
const Kind := Properties.Kind


class Spy:
	extends GaussianAvatar3D
	var seen: Dictionary

	func drive(weights: Variant) -> String:
		seen = (weights as Dictionary).duplicate()
		return ""


func _initialize() -> void:
	await process_frame  # the root is in the tree
	var given: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://given.json"))
	var told := {}
	told["clips"] = given["packs"].map(clips)
	told["poses"] = given["packs"].map(poses.bind(given["poses"]))
	told["shadows"] = given["packs"].map(shadows.bind(given["poses"]))
	told["scene"] = scene()
	told["live"] = await live(given["packets"])
	told["idle"] = await idle(given["idle"])
	told["tracker"] = await tracker()
	told["refused"] = refused()
	print("RESULT ", JSON.stringify(told, "", true, true))
	quit()


func shown(path: String) -> GaussianAvatar3D:
	var node: GaussianAvatar3D = (load(path) as PackedScene).instantiate(PackedScene.GEN_EDIT_STATE_INSTANCE)
	root.add_child(node)
	return node


func floats(node: GaussianAvatar3D) -> Array:
	return Array(node.core.call(&"pose_floats"))


## Of each clip by its name, the pose at each key; played one after another, so that each must undo the last.
func clips(path: String) -> Dictionary:
	var node := shown(path)
	var player: AnimationPlayer = node.get_node("AnimationPlayer")
	var found := {}
	for i in node.facts["clips"].size():
		var clip: String = node.facts["clips"][i]["name"]
		player.play(clip)
		found[clip] = []
		for time: float in node.core.call(&"clip_tracks", i)["times"]:
			player.seek(time, true)
			found[clip].append(floats(node))
	node.free()
	return found


## Poses that are set by properties, backwards: their order must not matter.
func poses(path: String, all: Dictionary) -> Array:
	var node := shown(path)
	var found := []
	for one: Dictionary in all[path]:
		take(node, one)
		found.append(floats(node))
	node.free()
	return found


func take(node: GaussianAvatar3D, one: Dictionary) -> void:
	for i in range(one["expressions"].size() - 1, -1, -1):
		put(node, Kind.EXPRESSION, i, one["expressions"][i])
	for i in one["eyelids"].size():
		put(node, Kind.EYELID, i, one["eyelids"][i])
	for i in one["joints"].size():
		var delta := matrix(one["joints"][i])
		put(node, Kind.SCALE, i, delta.basis.get_scale())
		put(node, Kind.ROTATION, i, delta.basis.get_rotation_quaternion())
		put(node, Kind.POSITION, i, delta.origin)
	put(node, Kind.ROOT_ROTATION, 0, matrix(one["root"]).basis.get_rotation_quaternion())
	put(node, Kind.ROOT_POSITION, 0, matrix(one["root"]).origin)


## Of each pose: the bones and blend shapes of the mesh that casts the shadow, by name.
func shadows(path: String, all: Dictionary) -> Array:
	var node := shown(path)
	var caster := GaussianAvatarShadow.new()
	caster.rig = load("res://rig.glb")
	node.add_child(caster)
	var skeleton: Skeleton3D = caster.find_children("*", "Skeleton3D", true, false)[0]
	var mesh: MeshInstance3D = caster.find_children("*", "MeshInstance3D", true, false)[0]
	var found := []
	for one: Dictionary in all[path]:
		take(node, one)
		caster.call(&"_process", 0.0)
		var posed := {"root": rows(skeleton.get_parent().transform), "bones": {}, "shapes": {}}
		for bone in skeleton.get_bone_count():
			posed["bones"][skeleton.get_bone_name(bone)] = rows(skeleton.get_bone_pose(bone))
		for shape in mesh.get_blend_shape_count():
			posed["shapes"][mesh.mesh.get_blend_shape_name(shape)] = mesh.get_blend_shape_value(shape)
		found.append(posed)
	assert(mesh.cast_shadow == GeometryInstance3D.SHADOW_CASTING_SETTING_SHADOWS_ONLY)
	node.free()
	return found


## [3, 4].
func rows(of: Transform3D) -> Array:
	return range(3).map(func(r: int) -> Array: return [of.basis.x[r], of.basis.y[r], of.basis.z[r], of.origin[r]])


func put(node: GaussianAvatar3D, kind: int, index: int, value: Variant) -> void:
	var property := String(node.path_of(kind, index)).trim_prefix(".:")
	node.set(property, value)
	assert(typeof(node.get(property)) == typeof(value))


func matrix(rows: Array) -> Transform3D:
	var columns := range(4).map(func(c: int) -> Vector3: return Vector3(rows[c], rows[4 + c], rows[8 + c]))
	return Transform3D(columns[0], columns[1], columns[2], columns[3])


## What a scene keeps of an avatar in it; and what comes back, also to one whose file was away for a while.
func scene() -> Dictionary:
	var top := Node3D.new()
	root.add_child(top)
	var node: GaussianAvatar3D = load("res://right.avatar").instantiate(PackedScene.GEN_EDIT_STATE_INSTANCE)
	top.add_child(node)
	node.owner = top
	var turn := Quaternion(Vector3.UP, 0.5)
	node.set("expressions/mouth/mouthSmileLeft", 0.25)
	node.set("expressions/other/exp_003", 0.5)
	node.set("joints/jaw/rotation", turn)
	node.set("expressions/other/exp_003", node.property_get_revert("expressions/other/exp_003"))
	var found := {"stored": stored(top)}
	found["listed"] = []
	for property in node.get_property_list():
		if property["name"].contains("/") or property["name"] in ["licence", "consent", "levels", "level"]:
			found["listed"].append(property)
	found["can_revert"] = node.property_can_revert("joints/jaw/scale") and not node.property_can_revert("joints/no/scale")
	found["aliases"] = [node.set_expression("mouthSmile_L", 0.75), node.get("expressions/mouth/mouthSmileLeft")]
	top.free()
	# A scene with the first one in it takes a value back.
	var heir := Node3D.new()
	root.add_child(heir)
	var inner: Node = (load("res://kept.tscn") as PackedScene).instantiate(PackedScene.GEN_EDIT_STATE_INSTANCE)
	heir.add_child(inner)
	inner.owner = heir
	heir.set_editable_instance(inner, true)
	node = inner.get_child(0)
	found["loaded"] = [node.get("expressions/mouth/mouthSmileLeft"), node.get("joints/jaw/rotation") == turn]
	node.set("expressions/mouth/mouthSmileLeft", 0.0)
	found["heir"] = stored(heir, "res://heir.tscn")
	var file := node.avatar
	node.avatar = null
	node.avatar = file
	found["back"] = node.get("joints/jaw/rotation") == turn
	heir.free()
	return found


## The lines of a saved scene that belong to the avatar.
func stored(top: Node, path := "res://kept.tscn") -> Array:
	var packed := PackedScene.new()
	packed.pack(top)
	ResourceSaver.save(packed, path)
	packed.take_over_path(path)
	var lines := FileAccess.get_file_as_string(path).split("\n")
	var from := 0
	while not lines[from].begins_with("[node name=\"right\""):
		from += 1
	return Array(lines.slice(from + 1)).filter(func(line: String) -> bool: return line.contains(" = ") and not line.begins_with("["))


## The pose after each recorded packet.
func live(packets: String) -> Array:
	var node := shown("res://right.avatar")
	var link := LiveLinkFace.new()
	link.address = "127.0.0.1"
	link.port = 20000 + OS.get_process_id() % 20000
	node.add_child(link)
	var sender := PacketPeerUDP.new()
	sender.set_dest_address("127.0.0.1", link.port)
	var found := []
	var file := FileAccess.open(packets, FileAccess.READ)
	while file.get_position() < file.get_length():
		sender.put_packet(file.get_buffer(file.get_32()))
		for tries in PORT_TRIES:
			await process_frame
			if link.received_count > found.size():
				break
		found.append(floats(node))
	node.free()
	return found


## The face of idle life at times and seeds, and the pose that its node gives.
func idle(cases: Array) -> Dictionary:
	var node := shown("res://right.avatar")
	var found := {"faces": cases.map(func(one: Dictionary) -> Array: return Array(node.core.call(&"idle", one["seconds"], int(one["seed"]))))}
	var life := GaussianAvatarIdle.new()
	life.seed = 5
	node.add_child(life)
	await process_frame
	life.set_process(false)
	found.merge({"seconds": life.seconds, "pose": floats(node)})
	node.free()
	return found


## For each Unified Expression which of ARKit's weights it moves.
func tracker() -> Dictionary:
	var spy := Spy.new()
	root.add_child(spy)
	spy.add_child(GaussianAvatarFaceTracker.new())
	await process_frame
	var found := {"without": spy.seen.size()}
	var face := XRFaceTracker.new()
	face.name = &"/user/face_tracker"
	XRServer.add_tracker(face)
	for entry in XRFaceTracker.FT_MAX:
		var shapes := PackedFloat32Array()
		shapes.resize(XRFaceTracker.FT_MAX)
		shapes[entry] = 0.75
		face.blend_shapes = shapes
		await process_frame
		var constant: String = ""
		for name: String in ClassDB.class_get_enum_constants(&"XRFaceTracker", &"BlendShapeEntry"):
			if ClassDB.class_get_integer_constant(&"XRFaceTracker", name) == entry:
				constant = name
		found[constant] = spy.seen.keys().filter(func(channel: StringName) -> bool: return spy.seen[channel] == 0.75)
	found["channels"] = spy.seen.keys()
	XRServer.remove_tracker(face)
	spy.free()
	return found


## What drive says to what it does not understand, and a node without an avatar.
func refused() -> Dictionary:
	var node := shown("res://right.avatar")
	var empty := GaussianAvatar3D.new()
	var found := {
		"unknown": node.drive({"jawWide": 1.0}),
		"few": node.drive(PackedFloat32Array([1, 2])),
		"kind": node.drive("jawOpen"),
		"empty": empty.drive({}),
		"warnings": [node._get_configuration_warnings(), empty._get_configuration_warnings()],
		"aabb": [node.get_aabb().has_volume(), empty.get_aabb().has_volume()],
	}
	found["driven"] = [node.drive({"jawOpen": 1.0}), floats(node)]
	node.set("joints/jaw/position", Vector3.ZERO)  # where it is; its turn, which the face gave it, stays
	found["touched"] = floats(node)
	var weights := PackedFloat32Array()
	weights.resize(52)
	weights[17] = 1.0
	found["as_floats"] = [node.drive(weights), floats(node)]
	node.free()
	empty.free()
	return found
