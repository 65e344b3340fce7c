extends Node3D
## The sample head among lit things. Gaussians cast no shadow: the mesh of rig.glb, which nobody sees, does.

const CLIP := &"held_out"
const TOWARDS := Vector3(0.0, 0.31, 0.0)

var seconds := 0.0
var period := 0.0  # of a swing of the camera, and of two turns of the ring; the clip runs there and back in it

@onready var camera: Camera3D = $Camera
@onready var ring: MeshInstance3D = $Ring


func _ready() -> void:
	for mesh: MeshInstance3D in $Shadow.find_children("*", "MeshInstance3D", true, false):
		mesh.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_SHADOWS_ONLY
	for player: AnimationPlayer in [$Head/AnimationPlayer, $Shadow/AnimationPlayer]:
		var clip := player.get_animation(CLIP)
		clip.loop_mode = Animation.LOOP_PINGPONG
		period = 2.0 * clip.length
		player.play(CLIP)
	_process(0.0)


func _process(delta: float) -> void:
	seconds += delta
	var turn := TAU * seconds / period
	camera.position = Vector3(0.35 * sin(turn), 0.42, 0.85)
	camera.look_at(TOWARDS)
	ring.rotation = Vector3(0.35 * sin(2.0 * turn), 0.0, 0.35 * cos(2.0 * turn))
	ring.position.y = 0.36 + 0.07 * sin(turn)
