@icon("icon.svg")
class_name GaussianAvatarFaceTracker
extends Node
## Drives an avatar by a face that an XR headset sees: an XRFaceTracker of the XRServer, which has Unified Expressions.

## For each of ARKit's names the Unified Expressions that mean it: of several the largest counts. Trackers set the fine
## ones, or one that joins them. Left and right are the person's in both.
const ARKIT: Dictionary[StringName, Array] = {
	&"eyeBlinkLeft": ["EYE_CLOSED_LEFT", "EYE_CLOSED"],
	&"eyeLookDownLeft": ["EYE_LOOK_DOWN_LEFT"],
	&"eyeLookInLeft": ["EYE_LOOK_IN_LEFT"],
	&"eyeLookOutLeft": ["EYE_LOOK_OUT_LEFT"],
	&"eyeLookUpLeft": ["EYE_LOOK_UP_LEFT"],
	&"eyeSquintLeft": ["EYE_SQUINT_LEFT", "EYE_SQUINT"],
	&"eyeWideLeft": ["EYE_WIDE_LEFT", "EYE_WIDE"],
	&"eyeBlinkRight": ["EYE_CLOSED_RIGHT", "EYE_CLOSED"],
	&"eyeLookDownRight": ["EYE_LOOK_DOWN_RIGHT"],
	&"eyeLookInRight": ["EYE_LOOK_IN_RIGHT"],
	&"eyeLookOutRight": ["EYE_LOOK_OUT_RIGHT"],
	&"eyeLookUpRight": ["EYE_LOOK_UP_RIGHT"],
	&"eyeSquintRight": ["EYE_SQUINT_RIGHT", "EYE_SQUINT"],
	&"eyeWideRight": ["EYE_WIDE_RIGHT", "EYE_WIDE"],
	&"jawForward": ["JAW_FORWARD"],
	&"jawRight": ["JAW_RIGHT"],
	&"jawLeft": ["JAW_LEFT"],
	&"jawOpen": ["JAW_OPEN"],
	&"mouthClose": ["MOUTH_CLOSED"],
	&"mouthFunnel": [
		"LIP_FUNNEL_UPPER_RIGHT", "LIP_FUNNEL_UPPER_LEFT", "LIP_FUNNEL_LOWER_RIGHT", "LIP_FUNNEL_LOWER_LEFT",
		"LIP_FUNNEL_UPPER", "LIP_FUNNEL_LOWER", "LIP_FUNNEL",
	],
	&"mouthPucker": [
		"LIP_PUCKER_UPPER_RIGHT", "LIP_PUCKER_UPPER_LEFT", "LIP_PUCKER_LOWER_RIGHT", "LIP_PUCKER_LOWER_LEFT",
		"LIP_PUCKER_UPPER", "LIP_PUCKER_LOWER", "LIP_PUCKER",
	],
	&"mouthRight": ["MOUTH_UPPER_RIGHT", "MOUTH_LOWER_RIGHT", "MOUTH_RIGHT"],
	&"mouthLeft": ["MOUTH_UPPER_LEFT", "MOUTH_LOWER_LEFT", "MOUTH_LEFT"],
	&"mouthSmileLeft": ["MOUTH_CORNER_PULL_LEFT", "MOUTH_SMILE_LEFT", "MOUTH_SMILE"],
	&"mouthSmileRight": ["MOUTH_CORNER_PULL_RIGHT", "MOUTH_SMILE_RIGHT", "MOUTH_SMILE"],
	&"mouthFrownLeft": ["MOUTH_FROWN_LEFT", "MOUTH_SAD_LEFT", "MOUTH_SAD"],
	&"mouthFrownRight": ["MOUTH_FROWN_RIGHT", "MOUTH_SAD_RIGHT", "MOUTH_SAD"],
	&"mouthDimpleLeft": ["MOUTH_DIMPLE_LEFT", "MOUTH_DIMPLE"],
	&"mouthDimpleRight": ["MOUTH_DIMPLE_RIGHT", "MOUTH_DIMPLE"],
	&"mouthStretchLeft": ["MOUTH_STRETCH_LEFT", "MOUTH_STRETCH"],
	&"mouthStretchRight": ["MOUTH_STRETCH_RIGHT", "MOUTH_STRETCH"],
	&"mouthRollLower": ["LIP_SUCK_LOWER_RIGHT", "LIP_SUCK_LOWER_LEFT", "LIP_SUCK_LOWER", "LIP_SUCK"],
	&"mouthRollUpper": ["LIP_SUCK_UPPER_RIGHT", "LIP_SUCK_UPPER_LEFT", "LIP_SUCK_UPPER", "LIP_SUCK"],
	&"mouthShrugLower": ["MOUTH_RAISER_LOWER"],
	&"mouthShrugUpper": ["MOUTH_RAISER_UPPER"],
	&"mouthPressLeft": ["MOUTH_PRESS_LEFT", "MOUTH_PRESS"],
	&"mouthPressRight": ["MOUTH_PRESS_RIGHT", "MOUTH_PRESS"],
	&"mouthLowerDownLeft": ["MOUTH_LOWER_DOWN_LEFT", "MOUTH_LOWER_DOWN"],
	&"mouthLowerDownRight": ["MOUTH_LOWER_DOWN_RIGHT", "MOUTH_LOWER_DOWN"],
	&"mouthUpperUpLeft": ["MOUTH_UPPER_UP_LEFT", "MOUTH_UPPER_UP"],
	&"mouthUpperUpRight": ["MOUTH_UPPER_UP_RIGHT", "MOUTH_UPPER_UP"],
	&"browDownLeft": ["BROW_LOWERER_LEFT", "BROW_DOWN_LEFT", "BROW_DOWN"],
	&"browDownRight": ["BROW_LOWERER_RIGHT", "BROW_DOWN_RIGHT", "BROW_DOWN"],
	&"browInnerUp": ["BROW_INNER_UP_RIGHT", "BROW_INNER_UP_LEFT", "BROW_UP_RIGHT", "BROW_UP_LEFT", "BROW_UP"],
	&"browOuterUpLeft": ["BROW_OUTER_UP_LEFT", "BROW_UP_LEFT", "BROW_UP"],
	&"browOuterUpRight": ["BROW_OUTER_UP_RIGHT", "BROW_UP_RIGHT", "BROW_UP"],
	&"cheekPuff": ["CHEEK_PUFF_RIGHT", "CHEEK_PUFF_LEFT", "CHEEK_PUFF"],
	&"cheekSquintLeft": ["CHEEK_SQUINT_LEFT", "CHEEK_SQUINT"],
	&"cheekSquintRight": ["CHEEK_SQUINT_RIGHT", "CHEEK_SQUINT"],
	&"noseSneerLeft": ["NOSE_SNEER_LEFT", "NOSE_SNEER"],
	&"noseSneerRight": ["NOSE_SNEER_RIGHT", "NOSE_SNEER"],
	&"tongueOut": ["TONGUE_OUT"],
}

## The avatar to drive; nothing: the node above.
@export var avatar: GaussianAvatar3D

## The name of the tracker; OpenXR's is this one.
@export var tracker: StringName = &"/user/face_tracker"

var _weights: Dictionary[StringName, float] = {}
var _entries: Dictionary[StringName, PackedInt32Array] = {}


func _ready() -> void:
	for channel in ARKIT:
		var entries := PackedInt32Array()
		for expression: String in ARKIT[channel]:
			entries.append(ClassDB.class_get_integer_constant(&"XRFaceTracker", "FT_" + expression))
		_entries[channel] = entries


func _process(_delta: float) -> void:
	var face := XRServer.get_tracker(tracker) as XRFaceTracker
	var driven := avatar if avatar != null else get_parent() as GaussianAvatar3D
	if face == null or driven == null:
		return
	for channel in ARKIT:
		var largest := 0.0
		for entry in _entries[channel]:
			largest = maxf(largest, face.get_blend_shape(entry))
		_weights[channel] = largest
	var line := driven.drive(_weights)
	if not line.is_empty():
		push_error(line)
		set_process(false)
