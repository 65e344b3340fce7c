@tool
@icon("icon.svg")
class_name GaussianAvatarShadow
extends Node3D
## Lets the avatar above it cast its shadow onto the scene: the mesh of its rig.glb takes its pose, and nobody sees it.

const CORRECTIVE := "corrective_%s_%d%d"  # of a joint, row and column
const NO_RIG := "No shadow is cast: set \"rig\" to the avatar's rig.glb, below a GaussianAvatar3D that it belongs to."

## The imported rig.glb of the avatar.
@export var rig: PackedScene:
	set(value):
		rig = value
		_load()

var _core: RefCounted  # whose names these are
var _seen := -1  # of its changes
var _top: Node3D
var _skeleton: Skeleton3D
var _mesh: MeshInstance3D
var _bones := PackedInt32Array()  # by joint; -1: none
var _rests: Array[Transform3D] = []
var _expressions := PackedInt32Array()  # blend shapes
var _eyelids := PackedInt32Array()
var _corrected := PackedInt32Array()  # joints
var _correctives := PackedInt32Array()  # the first of nine blend shapes of each


func _init() -> void:
	process_priority = 1000  # after all that poses


func _load() -> void:
	_core = null
	if _top != null:
		_top.get_parent().free()
	_top = null
	var made: Node = rig.instantiate() if rig != null else null
	var meshes := made.find_children("*", "MeshInstance3D", true, false) if made != null else []
	var skeletons := made.find_children("*", "Skeleton3D", true, false) if made != null else []
	if not meshes.is_empty() and not skeletons.is_empty():
		_mesh = meshes[0]
		_mesh.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_SHADOWS_ONLY
		_skeleton = skeletons[0]
		_top = _skeleton.get_parent_node_3d()
		for player in made.find_children("*", "AnimationPlayer", true, false):
			player.free()
		add_child(made)
	elif made != null:
		made.free()
	update_configuration_warnings()


func _process(_delta: float) -> void:
	var avatar := get_parent() as GaussianAvatar3D
	if avatar == null or avatar.core == null or _top == null:
		return
	if avatar.core != _core:
		_take_names(avatar)
	elif avatar.changes == _seen:
		return
	_seen = avatar.changes
	_top.transform = _core.call(&"root")
	for joint in _bones.size():
		if _bones[joint] >= 0:
			_skeleton.set_bone_pose(_bones[joint], _rests[joint] * (_core.call(&"joint", joint) as Transform3D))
	for i in _expressions.size():
		_shape(_expressions[i], _core.call(&"expression", i))
	for i in _eyelids.size():
		_shape(_eyelids[i], _core.call(&"eyelid", i))
	for i in _corrected.size():
		var turn := (_core.call(&"joint", _corrected[i]) as Transform3D).basis
		for entry in 9:
			@warning_ignore("integer_division")
			var row := entry / 3
			_shape(_correctives[i] + entry, turn[entry % 3][row] - (1.0 if row == entry % 3 else 0.0))


func _shape(index: int, weight: float) -> void:
	if index >= 0:
		_mesh.set_blend_shape_value(index, weight)


## Blend shapes are named as in the file: expressions, correctives of joints, eyelids.
func _take_names(avatar: GaussianAvatar3D) -> void:
	_core = avatar.core
	for list: PackedInt32Array in [_bones, _expressions, _eyelids, _corrected, _correctives]:
		list.clear()
	_rests.clear()
	for expression: Dictionary in avatar.facts["expressions"]:
		_expressions.append(_mesh.find_blend_shape_by_name(expression["name"]))
	for eyelid: String in avatar.facts["eyelids"]:
		_eyelids.append(_mesh.find_blend_shape_by_name(eyelid))
	for joint: Dictionary in avatar.facts["joints"]:
		var first := _mesh.find_blend_shape_by_name(CORRECTIVE % [joint["name"], 0, 0])
		if first >= 0:
			_corrected.append(_bones.size())
			_correctives.append(first)
		_bones.append(_skeleton.find_bone((joint["name"] as String).replace(":", "_").replace("/", "_")))
		_rests.append(joint["rest"])


func _get_configuration_warnings() -> PackedStringArray:
	return [] if _top != null and get_parent() is GaussianAvatar3D else [NO_RIG]


func _notification(what: int) -> void:
	if what == NOTIFICATION_PARENTED:
		update_configuration_warnings()
