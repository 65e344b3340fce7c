@tool
extends EditorImportPlugin
## Makes of NAME.avatar a scene: a GaussianAvatar3D, and an AnimationPlayer with the clips of the file.

const PoseProperties := preload("pose_properties.gd")
const FORBIDDEN: PackedStringArray = ["/", ":", ",", "["]  # in the name of an animation
const CLIP_STEP := 1.0 / 16384.0  # of a matrix in a clip: what a file rounds to


func _get_importer_name() -> String:
	return "gaussian_avatar"


func _get_visible_name() -> String:
	return "Gaussian Avatar"


func _get_recognized_extensions() -> PackedStringArray:
	return ["avatar"]


func _get_save_extension() -> String:
	return "scn"


func _get_resource_type() -> String:
	return "PackedScene"


func _get_format_version() -> int:
	return 1


func _get_priority() -> float:
	return 1.0


func _get_import_order() -> int:
	return 0


func _get_preset_count() -> int:
	return 0


func _get_import_options(_path: String, _preset: int) -> Array[Dictionary]:
	return []


func _can_import_threaded() -> bool:
	return false


func _import(source: String, save: String, _options: Dictionary, _variants: Array[String], _made: Array[String]) -> Error:
	var core: RefCounted = GaussianAvatar.make_core()
	if core == null:
		push_error("%s: %s" % [source.get_file(), GaussianAvatar3D.NO_EXTENSION])
		return ERR_UNAVAILABLE
	var line: String = core.call(&"load", FileAccess.get_file_as_bytes(source), source.get_file())
	if not line.is_empty():
		push_error(line)
		return ERR_FILE_CORRUPT
	FileAccess.open(save + ".webp", FileAccess.WRITE).store_buffer(core.call(&"facts")["preview"])  # for preview.gd
	var root := _scene(source)
	var scene := PackedScene.new()
	scene.pack(root)
	root.free()
	return ResourceSaver.save(scene, save + "." + _get_save_extension())


func _scene(source: String) -> GaussianAvatar3D:
	var root := GaussianAvatar3D.new()
	root.name = source.get_file().get_basename()
	root.avatar = GaussianAvatar.read(source)
	root.stores_all = true
	var clips: Array = root.facts["clips"]
	if clips.is_empty():
		return root
	var player := AnimationPlayer.new()
	player.name = "AnimationPlayer"
	root.add_child(player)
	player.owner = root
	player.add_animation_library("", _library(root, clips))
	return root


## The clips. What any clip moves has a track in all of them, else one clip would keep what the last one left.
func _library(root: GaussianAvatar3D, clips: Array) -> AnimationLibrary:
	var library := AnimationLibrary.new()
	var moved: Dictionary[NodePath, Variant] = {}  # what stands there at rest
	var made: Array[Animation] = []
	for i in clips.size():
		made.append(_animation(root, i, clips[i], moved))
		library.add_animation(_free_name(library, clips[i]["name"]), made[i])
	for animation in made:
		for path in moved:
			if animation.find_track(path, Animation.TYPE_VALUE) < 0:
				_track(animation, path, [0.0], [moved[path]])
	return library


static func _free_name(library: AnimationLibrary, wanted: String) -> StringName:
	for letter in FORBIDDEN:
		wanted = wanted.replace(letter, "_")
	var free := wanted
	var copy := 2
	while free.is_empty() or free == "RESET" or library.has_animation(free):
		free = "%s %d" % [wanted, copy]
		copy += 1
	return free


func _animation(root: GaussianAvatar3D, clip: int, told: Dictionary, moved: Dictionary[NodePath, Variant]) -> Animation:
	var animation := Animation.new()
	animation.length = maxf(told["seconds"], 0.001)
	animation.step = 1.0 / told["fps"]
	var tracks: Dictionary = root.core.call(&"clip_tracks", clip)
	var add := func(kind: PoseProperties.Kind, index: int, values: Array, rest: Variant) -> void:
		var path := root.path_of(kind, index)
		if path not in moved and not values.all(func(value: Variant) -> bool: return value == rest):
			moved[path] = rest
		if path in moved:
			_track(animation, path, tracks["times"], values)
	for index: int in tracks["expressions"]:
		add.call(PoseProperties.Kind.EXPRESSION, index, Array(tracks["expressions"][index]), 0.0)
	for index: int in tracks["eyelids"]:
		add.call(PoseProperties.Kind.EYELID, index, Array(tracks["eyelids"][index]), 0.0)
	for index: int in tracks["joints"]:
		var deltas: Array = tracks["joints"][index]
		add.call(PoseProperties.Kind.POSITION, index, deltas.map(_origin), Vector3.ZERO)
		add.call(PoseProperties.Kind.ROTATION, index, deltas.map(_rotation), Quaternion.IDENTITY)
		add.call(PoseProperties.Kind.SCALE, index, deltas.map(_scale), Vector3.ONE)
	if "root" in tracks:
		add.call(PoseProperties.Kind.ROOT_POSITION, 0, tracks["root"].map(_origin), Vector3.ZERO)
		add.call(PoseProperties.Kind.ROOT_ROTATION, 0, tracks["root"].map(_rotation), Quaternion.IDENTITY)
	return animation


static func _track(animation: Animation, path: NodePath, times: Array, values: Array) -> void:
	var track := animation.add_track(Animation.TYPE_VALUE)
	animation.track_set_path(track, path)
	var still := values.all(func(value: Variant) -> bool: return value == values[0])
	for key in 1 if still else values.size():
		animation.track_insert_key(track, times[key], values[key])


static func _origin(delta: Transform3D) -> Vector3:
	return delta.origin


static func _rotation(delta: Transform3D) -> Quaternion:
	return delta.basis.get_rotation_quaternion()


## A turn has a scale of 1, but for what the file has rounded.
static func _scale(delta: Transform3D) -> Vector3:
	var scale := delta.basis.get_scale()
	var off := (scale - Vector3.ONE).abs()
	return Vector3.ONE if maxf(off.x, maxf(off.y, off.z)) <= CLIP_STEP else scale
