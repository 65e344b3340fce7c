extends Node3D
## The sample head among lit things, in three lights one after the other: a sun, a lamp, and a spot from the side.

const CLIP := &"held_out"
const TOWARDS := Vector3(0.0, 0.31, 0.0)
const SKY: Array[float] = [0.75, 0.3, 0.4]  # how bright, in each light

var seconds := 0.0
var period := 0.0  # of a swing of the camera, and of two turns of the ring; the clip runs there and back in it

@onready var camera: Camera3D = $Camera
@onready var ring: MeshInstance3D = $Ring
@onready var lights: Array[Light3D] = [$Sun, $Lamp, $Side]
@onready var sky: Environment = $WorldEnvironment.environment


func _ready() -> void:
	var player: AnimationPlayer = $Head/AnimationPlayer
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
	var now := int(lights.size() * fposmod(seconds / period, 1.0))
	for i in lights.size():
		lights[i].visible = i == now
	sky.background_energy_multiplier = SKY[now]
