extends Node3D
## A game that the editor plays: it says in a file when the avatar is drawn, and goes on until it is stopped.

const Worlds := preload("res://addons/gaussian_avatar/worlds.gd")


func _ready() -> void:
	var camera := Camera3D.new()
	add_child(camera)
	camera.look_at_from_position(Vector3(0, 0, 2), Vector3.ZERO)
	for i in 8:
		await get_tree().process_frame
	var splats: int = Worlds.effect_of($head).call(&"statistics")["splats"]
	FileAccess.open("res://played.txt", FileAccess.WRITE).store_string("drawn" if splats > 0 else "not drawn")
