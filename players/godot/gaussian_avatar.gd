@tool
@icon("icon.svg")
class_name GaussianAvatar
extends Resource
## A file NAME.avatar: what a GaussianAvatar3D shows.

const MAKER := &"GaussianAvatarMaker"
const EXTENSION := "gaussian_avatar.gdextension"

## What errors call the file.
@export var name := "avatar"

## The whole file.
@export_storage var data: PackedByteArray:
	set(value):
		data = value
		_loaded = null

var _loaded: RefCounted  # what the cores of all nodes share; null where nothing was loaded yet


## A resource of a file that no importer has seen, such as one below user://. One that cannot be read has no data.
static func read(path: String) -> GaussianAvatar:
	var made := GaussianAvatar.new()
	made.name = path.get_file()
	made.data = FileAccess.get_file_as_bytes(path)
	return made


## Loads the file into the core of a node: it is read once, and is once on the GPU for each world. Returns "", or why not.
func load_into(core: RefCounted) -> String:
	if data.is_empty():
		return "%s: is empty, or cannot be read" % name
	if _loaded == null:
		var first := make_core()
		var line: String = first.call(&"load", data, name)
		if not line.is_empty():
			return line
		_loaded = first
	return core.call(&"load_same", _loaded)


## A GaussianAvatarCore. Null where there is no binary of the extension: the engine has said so.
static func make_core() -> RefCounted:
	return _maker().call(&"core") if _maker() != null else null


## A GaussianAvatarEffect, or null.
static func make_effect() -> CompositorEffect:
	return _maker().call(&"effect") if _maker() != null else null


static func _maker() -> Object:
	if not Engine.has_singleton(MAKER):
		# A project that is opened for the first time has not met the extension yet.
		var here: String = (GaussianAvatar as Script).resource_path.get_base_dir()
		GDExtensionManager.load_extension(here.path_join(EXTENSION))
	return Engine.get_singleton(MAKER) if Engine.has_singleton(MAKER) else null
