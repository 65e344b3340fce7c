@tool
@icon("icon.svg")
class_name GaussianAvatar3D
extends VisualInstance3D
## Shows an avatar of 3D Gaussians.
##
## Expressions, eyelids and joints are properties, named as the file names them: [code]expressions/mouth/mouthSmileLeft[/code],
## [code]eyelids/NAME[/code], [code]joints/NAME/rotation[/code]. An AnimationPlayer, a script, [method drive] and the
## inspector all write the same values: the last one counts.

const Worlds := preload("worlds.gd")
const PoseProperties := preload("pose_properties.gd")
const ARKIT_WEIGHTS := 52
const ARKIT_CHANNELS := 61
const NO_COMPUTE := "The Compatibility renderer has no compute shaders: no avatar is drawn. Use Forward+ or Mobile."
const NO_EXTENSION := "The add-on has no binary for this system: bin/ has no file that gaussian_avatar.gdextension names."

static var _channels: Dictionary[StringName, int] = {}  # of ARKit's names
static var _told_renderer := false

## What is shown: an imported NAME.avatar has it. [method GaussianAvatar.read] reads one at run time.
@export var avatar: GaussianAvatar:
	set(value):
		avatar = value
		_load()

## Level of detail, 0 the finest. -1: by the height of the avatar in the image.
@export var level := -1:
	set(value):
		level = value
		if core != null:
			core.call(&"set_level", mini(level, (facts["levels"] as Array).size() - 1))
			_changed()

## Limits what [method drive] sets to the trained ranges.
@export var within_range := false

## Whether the light of the scene falls on it, in place of the light that it was captured in. Of files that
## [code]avatar-export pack --relight[/code] made; others never change.
@export var lit := true

## The names of the expressions.
var names: PackedStringArray:
	get:
		return PackedStringArray((facts.get("expressions", []) as Array).map(func(one: Dictionary) -> String: return one["name"]))

## The loaded file and its pose, a GaussianAvatarCore; null where nothing is loaded.
var core: RefCounted

## What the file says of itself: name, license, consent, expressions, joints, clips, levels...
var facts: Dictionary = {}

## Grows whenever the pose is written.
var changes := 0

## Why nothing is shown; empty otherwise.
var error := ""

## Lists also values at rest as such that a scene stores. A scene made of a file has them all: so a scene that holds an
## instance of it stores what differs, and the editor finds all properties again after a reimport.
var stores_all: bool:
	get:
		return stores_all or not scene_file_path.is_empty()

var _properties: PoseProperties  # null where nothing is loaded
var _expressions: Dictionary[StringName, int] = {}  # names and aliases
var _held: Dictionary[StringName, Variant] = {}  # values that this avatar has no property for
var _inherited: Dictionary[StringName, bool] = {}  # properties that a scene has set: a scene that inherits it may set them back
var _frame := PackedFloat32Array()
var _light := PackedFloat32Array()  # as the effect has it
var _pose_changed := true
var _place_changed := true


## Sets an expression by its name or another name of it. False, and a line, where there is none.
func set_expression(expression: StringName, weight: float) -> bool:
	if expression not in _expressions:
		push_error("%s: there is no expression \"%s\"; `names` has them" % [_file(), expression])
		return false
	core.call(&"set_expression", _expressions[expression], weight)
	_changed()
	return true


## The weight of an expression; 0 where there is none.
func get_expression(expression: StringName) -> float:
	return core.call(&"expression", _expressions[expression]) if expression in _expressions else 0.0


## Writes the pose of a captured face. What the face does not move is at rest.
## [param weights]: a Dictionary of ARKit's names (a name that is not there is 0), or a PackedFloat32Array of the 52
## weights in ARKit's order, also with the nine angles in radians that Live Link Face sends. Returns "", or why not.
func drive(weights: Variant) -> String:
	if core == null:
		return "%s: no avatar is loaded" % name
	if weights is Dictionary:
		var line := _fill(weights)
		if not line.is_empty():
			return line
	elif weights is PackedFloat32Array and (weights as PackedFloat32Array).size() in [ARKIT_WEIGHTS, ARKIT_CHANNELS]:
		_frame = (weights as PackedFloat32Array).duplicate()
		_frame.resize(ARKIT_CHANNELS)
	else:
		return "%s: drive takes a Dictionary, or 52 or 61 numbers in a PackedFloat32Array" % name
	_properties.driven()
	_changed()
	return core.call(&"drive", _frame, within_range)


## Puts everything at rest.
func reset_pose() -> void:
	_held.clear()
	if core != null:
		core.call(&"reset_pose")
		_properties.rest_joints()
		_changed()


func _fill(weights: Dictionary) -> String:
	if _channels.is_empty():
		for channel: String in core.call(&"arkit_names"):
			_channels[channel] = _channels.size()
	_frame.resize(ARKIT_CHANNELS)
	_frame.fill(0.0)
	for channel: StringName in weights:
		if channel not in _channels:
			return "%s: ARKit has no \"%s\"" % [name, channel]
		_frame[_channels[channel]] = weights[channel]
	return ""


func _file() -> String:
	return avatar.name if avatar != null else String(name)


func _load() -> void:
	if _properties != null:
		for property in _properties.slots:
			if _properties.is_moved(property):
				_held[property] = _properties.value(property)
	Worlds.remove(self)
	core = null
	error = ""
	if avatar != null:
		core = GaussianAvatar.make_core()
		error = avatar.load_into(core) if core != null else NO_EXTENSION
		if not error.is_empty():
			push_error(error)
			core = null
	facts = core.call(&"facts") if core != null else {}
	_properties = PoseProperties.new(core, facts) if core != null else null
	_expressions.clear()
	if core != null:
		_take_names(facts["expressions"])
		_take_held()
	level = level
	_show()
	update_gizmos()
	update_configuration_warnings()
	notify_property_list_changed()


func _take_names(expressions: Array) -> void:
	for i in expressions.size():
		for known: String in [expressions[i]["name"]] + Array(expressions[i]["aliases"] as PackedStringArray):
			if known not in _expressions:
				_expressions[known] = i


func _take_held() -> void:
	for property: StringName in _held.keys():
		if property in _properties.slots:
			_properties.write(property, _held[property])
			_held.erase(property)


func _show() -> void:
	if core == null or not is_inside_tree():
		return
	Worlds.add(self)
	_light.clear()
	if RenderingServer.get_rendering_device() == null and DisplayServer.get_name() != "headless" and not _told_renderer:
		_told_renderer = true
		push_warning(NO_COMPUTE)
	_place_changed = true
	_changed()


func _changed() -> void:
	changes += 1
	if not _pose_changed:
		RenderingServer.instance_set_extra_visibility_margin(get_instance(), 0.0)  # the editor draws again
	_pose_changed = true


## Hands place and pose to who draws. Called by worlds.gd.
func before_frame(effect: CompositorEffect) -> void:
	var glides := is_physics_interpolated_and_enabled()  # between two steps of the physics
	if _place_changed or glides:
		_place_changed = false
		var place := get_global_transform_interpolated() if glides else global_transform
		effect.call(&"set_place", core, place, is_visible_in_tree())
	if _pose_changed:
		_pose_changed = false
		var line: String = core.call(&"commit")
		if line != error and not line.is_empty():
			push_error(line)
		error = line


## Whether the light of the scene changes it.
func takes_light() -> bool:
	return lit and facts.get("relit", false)


## Hands on a light of lights.gd that has changed. Called by worlds.gd.
func shine(effect: CompositorEffect, light: PackedFloat32Array) -> void:
	if light != _light:
		_light = light
		effect.call(&"set_light", core, light)


## The middle of where it stands, in the world.
func middle() -> Vector3:
	return global_transform * ((core.call(&"root") as Transform3D) * (facts["whole_target"] as Vector3))


func _notification(what: int) -> void:
	match what:
		NOTIFICATION_ENTER_WORLD:
			set_notify_transform(true)
			_show()
		NOTIFICATION_EXIT_WORLD:
			Worlds.remove(self)
		NOTIFICATION_TRANSFORM_CHANGED, NOTIFICATION_VISIBILITY_CHANGED:
			_place_changed = true


func _get_aabb() -> AABB:
	return facts.get("bounds", AABB())


func _get_configuration_warnings() -> PackedStringArray:
	var found := PackedStringArray()
	if core == null:
		found.append(error if not error.is_empty() else "Nothing is shown: set \"avatar\".")
	if RenderingServer.get_rendering_device() == null and DisplayServer.get_name() != "headless":
		found.append(NO_COMPUTE)
	return found


## The path of a property of the pose, for tracks of animations.
func path_of(kind: PoseProperties.Kind, index: int) -> NodePath:
	return _properties.path_of(kind, index)


func _get_property_list() -> Array[Dictionary]:
	var all: Array[Dictionary] = []
	if core != null:
		for fact: String in ["licence", "consent", "levels"]:
			all.append({"name": fact, "type": TYPE_STRING, "usage": PROPERTY_USAGE_EDITOR | PROPERTY_USAGE_READ_ONLY})
		for one in _properties.listed:
			var stored: bool = stores_all or one["name"] in _inherited or _properties.is_moved(one["name"])
			one["usage"] = PROPERTY_USAGE_EDITOR | (PROPERTY_USAGE_STORAGE if stored else PROPERTY_USAGE_NONE)
			all.append(one)
	for property in _held:
		all.append({"name": property, "type": typeof(_held[property]), "usage": PROPERTY_USAGE_STORAGE})
	return all


func _validate_property(property: Dictionary) -> void:
	if property["name"] == "level" and core != null:
		var hint := PackedStringArray(["By height:-1"])
		for one: Dictionary in facts["levels"]:
			hint.append("%d splats:%d" % [one["count"], hint.size() - 1])
		property["hint"] = PROPERTY_HINT_ENUM
		property["hint_string"] = ",".join(hint)


func _get(property: StringName) -> Variant:
	if _is_property(property):
		return _properties.value(property)
	match property:
		&"licence":
			return facts.get("license")
		&"consent":
			return facts.get("consent")
		&"levels":
			return _levels_text()
	return _held.get(property)


func _set(property: StringName, value: Variant) -> bool:
	if _is_property(property):
		_properties.write(property, value)
		_changed()
		if not is_node_ready() and _properties.is_moved(property):
			_inherited[property] = true
		return true
	if not property.contains("/") or property.get_slice("/", 0) not in ["expressions", "eyelids", "joints", "pose"]:
		return false
	_held[property] = value
	return true


func _property_can_revert(property: StringName) -> bool:
	return _is_property(property)


func _property_get_revert(property: StringName) -> Variant:
	return PoseProperties.rest(_properties.slots[property].x) if _is_property(property) else null


func _is_property(property: StringName) -> bool:
	return _properties != null and property in _properties.slots


func _levels_text() -> String:
	var lines := PackedStringArray()
	for one: Dictionary in facts.get("levels", []):
		var line := "%d splats" % one["count"]
		if one["height_px"] >= 0.0:
			line += ", up to %d pixels high" % one["height_px"]
		if one["psnr_db"] >= 0.0:
			line += ", %.1f dB" % one["psnr_db"]
		lines.append(line)
	return "; ".join(lines)
