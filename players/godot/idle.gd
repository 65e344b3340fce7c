@icon("icon.svg")
class_name GaussianAvatarIdle
extends Node
## Keeps an avatar alive that nobody drives: it breathes, blinks and looks about. It writes the whole face and the turn of
## the head: while a clip plays, set [member Node.process_mode] to PROCESS_MODE_DISABLED.

## The avatar to drive; nothing: the node above.
@export var avatar: GaussianAvatar3D

## Persons of different seeds blink and look at different times.
@warning_ignore("shadowed_global_identifier")
@export var seed := 0

## Seconds since the beginning. Equal seconds and seeds give equal poses.
var seconds := 0.0


func _process(delta: float) -> void:
	seconds += delta
	var driven := avatar if avatar != null else get_parent() as GaussianAvatar3D
	if driven == null or driven.core == null:
		return
	var line := driven.drive(driven.core.call(&"idle", seconds, seed))
	if not line.is_empty():
		push_error(line)
		set_process(false)
