@tool
extends RefCounted
## The pose of an avatar as properties: [code]expressions/mouth/mouthSmileLeft[/code], [code]eyelids/NAME[/code],
## [code]joints/NAME/rotation[/code], [code]pose/position[/code].

const PARTS: PackedStringArray = ["brow", "eye", "cheek", "nose", "jaw", "mouth", "tongue"]  # how ARKit's names begin
const OTHERS := "other"
const SLIDER := "%s,%s,0.001,or_greater,or_less"

enum Kind { EXPRESSION, EYELID, POSITION, ROTATION, SCALE, ROOT_POSITION, ROOT_ROTATION }

## Kind and index of each property.
var slots: Dictionary[StringName, Vector2i] = {}

## The properties as the inspector lists them.
var listed: Array[Dictionary] = []

var _core: RefCounted
var _counts: Dictionary[int, int] = {}
var _positions := PackedVector3Array()  # of joints, as they were set: a matrix gives no numbers back exactly
var _rotations: Array[Quaternion] = []
var _scales := PackedVector3Array()
var _driven := false  # the core has joints that these three do not have yet


func _init(core: RefCounted, facts: Dictionary) -> void:
	_core = core
	var joints: Array = facts["joints"]
	_positions.resize(joints.size())
	_rotations.resize(joints.size())
	_scales.resize(joints.size())
	rest_joints()
	for one: Dictionary in facts["expressions"]:
		var path := "expressions/%s/%s" % [_part(one["name"]), _plain(one["name"])]
		_add(path, Kind.EXPRESSION, SLIDER % [one["low"], one["high"]])
	for eyelid: String in facts["eyelids"]:
		_add("eyelids/" + _plain(eyelid), Kind.EYELID, SLIDER % [0, 1])
	for joint: Dictionary in joints:
		var path := "joints/" + _plain(joint["name"])
		_add(path + "/position", Kind.POSITION, "suffix:m")
		_add(path + "/rotation", Kind.ROTATION, "")
		_add(path + "/scale", Kind.SCALE, "")
	_add("pose/position", Kind.ROOT_POSITION, "suffix:m")
	_add("pose/rotation", Kind.ROOT_ROTATION, "")


## The path of a property, for tracks of animations.
func path_of(kind: Kind, index: int) -> NodePath:
	return NodePath(".:" + slots.find_key(Vector2i(kind, index)))


## What a property is where nothing moves.
static func rest(kind: Kind) -> Variant:
	match kind:
		Kind.POSITION, Kind.ROOT_POSITION:
			return Vector3.ZERO
		Kind.ROTATION, Kind.ROOT_ROTATION:
			return Quaternion.IDENTITY
		Kind.SCALE:
			return Vector3.ONE
	return 0.0


## Whether a property differs from its rest.
func is_moved(property: StringName) -> bool:
	return value(property) != rest(slots[property].x)


## The value of a property.
func value(property: StringName) -> Variant:
	var slot := slots[property]
	if _driven and slot.x in [Kind.POSITION, Kind.ROTATION, Kind.SCALE]:
		_read_joints()
	match slot.x:
		Kind.EXPRESSION:
			return _core.call(&"expression", slot.y)
		Kind.EYELID:
			return _core.call(&"eyelid", slot.y)
		Kind.POSITION:
			return _positions[slot.y]
		Kind.ROTATION:
			return _rotations[slot.y]
		Kind.SCALE:
			return _scales[slot.y]
		Kind.ROOT_POSITION:
			return _root().origin
	return _root().basis.get_rotation_quaternion()


## Sets a property.
func write(property: StringName, to: Variant) -> void:
	var slot := slots[property]
	match slot.x:
		Kind.EXPRESSION:
			_core.call(&"set_expression", slot.y, to)
		Kind.EYELID:
			_core.call(&"set_eyelid", slot.y, to)
		Kind.ROOT_POSITION:
			_core.call(&"set_root", Transform3D(_root().basis, to))
		Kind.ROOT_ROTATION:
			_core.call(&"set_root", Transform3D(_turn(to), _root().origin))
		_:
			_write_joint(slot.x, slot.y, to)


## The core has a pose that did not come through here.
func driven() -> void:
	_driven = true


## All joints are at rest.
func rest_joints() -> void:
	_driven = false
	_positions.fill(Vector3.ZERO)
	_rotations.fill(Quaternion.IDENTITY)
	_scales.fill(Vector3.ONE)


func _add(path: String, kind: Kind, hint: String) -> void:
	var free := path
	while free in slots:
		free += "_"
	slots[free] = Vector2i(kind, _counts.get(kind, 0))
	_counts[kind] = slots[free].y + 1
	var hint_type := PROPERTY_HINT_RANGE if typeof(rest(kind)) == TYPE_FLOAT else PROPERTY_HINT_NONE
	listed.append({"name": free, "type": typeof(rest(kind)), "hint": hint_type, "hint_string": hint})


## What a name may hold in the path of a property.
static func _plain(text: String) -> String:
	return text.replace("/", "_").replace(":", "_")


static func _part(expression: String) -> String:
	for part in PARTS:
		var next := expression.substr(part.length(), 1)
		if expression.begins_with(part) and next == next.to_upper():
			return part
	return OTHERS


func _root() -> Transform3D:
	return _core.call(&"root")


func _write_joint(kind: Kind, joint: int, to: Variant) -> void:
	if _driven:
		_read_joints()
	match kind:
		Kind.POSITION:
			_positions[joint] = to
		Kind.ROTATION:
			_rotations[joint] = to
		Kind.SCALE:
			_scales[joint] = to
	var basis := _turn(_rotations[joint]) * Basis.from_scale(_scales[joint])
	_core.call(&"set_joint", joint, Transform3D(basis, _positions[joint]))


static func _turn(rotation: Quaternion) -> Basis:
	return Basis(rotation.normalized()) if rotation.length_squared() > 0.0 else Basis.IDENTITY


## A driven face only turns joints.
func _read_joints() -> void:
	rest_joints()
	for joint in _rotations.size():
		_rotations[joint] = (_core.call(&"joint", joint) as Transform3D).basis.get_rotation_quaternion()
