@tool
extends EditorPlugin
## What happens in the editor: icons, a scene that moves at once, reimports. Prints one line of JSON.

const Worlds := preload("res://addons/gaussian_avatar/worlds.gd")

var told := {}


func _enter_tree() -> void:
	begin.call_deferred()


func begin() -> void:
	await frames(5)
	var given: PackedStringArray = FileAccess.get_file_as_string("res://given.txt").split("\n")
	EditorInterface.set_main_screen_editor("3D")
	EditorInterface.get_resource_previewer().queue_resource_preview("res://head.avatar", self, &"icon", null)
	EditorInterface.open_scene_from_path("res://user.tscn")
	await frames(5)
	await moves()
	await reimported(given[0], "new")
	await reimported(given[1], "hostile")
	await reimported(given[2], "sound")
	await played()
	for plugin in get_tree().root.find_children("*", "EditorPlugin", true, false):
		if plugin.has_method(&"_conform"):
			plugin.call(&"_conform", given[3])
	while "icon" not in told:
		await get_tree().process_frame
	print("RESULT ", JSON.stringify(told))
	get_tree().quit()


func frames(count: int) -> void:
	for i in count:
		await get_tree().process_frame


func head() -> Node:
	return EditorInterface.get_edited_scene_root().get_node_or_null("head")


func icon(_path: String, preview: Texture2D, _small: Texture2D, _data: Variant) -> void:
	told["icon"] = preview.get_image().get_size() if preview != null else Vector2i.ZERO


func drawn() -> int:
	return Worlds.effect_of(head()).call(&"statistics")["frames"]


## Whether the editor draws again where a property of the selected or of another node changes, and only then.
func moves() -> void:
	told["clickable"] = head().get_gizmos().size()
	EditorInterface.get_selection().add_node(head())
	await frames(12)
	var before := drawn()
	await frames(10)
	var still := drawn()
	head().set("expressions/jaw/jawOpen", 0.5)
	await frames(5)
	told["drawn"] = [still - before, drawn() > still]
	head().set("joints/jaw/rotation", Quaternion(Vector3.UP, 0.5))
	EditorInterface.mark_scene_as_unsaved()
	EditorInterface.save_scene()


## Another file in its place.
func reimported(from: String, what: String) -> void:
	DirAccess.copy_absolute(from, ProjectSettings.globalize_path("res://head.avatar"))
	EditorInterface.get_resource_filesystem().reimport_files(["res://head.avatar"])
	await frames(6)
	var node := head()
	var is_shown := node is GaussianAvatar3D and node.core != null
	told[what] = {
		"name": node.facts["name"] if is_shown else "",
		"jaw": node.get("expressions/jaw/jawOpen") if is_shown else 0.0,
		"turned": is_shown and node.get("joints/jaw/rotation") == Quaternion(Vector3.UP, 0.5),
		"box": EditorInterface.get_edited_scene_root().get_node_or_null("Box") != null,
	}


## Play and stop: the game runs beside the editor, and says so in a file.
func played() -> void:
	EditorInterface.play_custom_scene("res://played.tscn")
	var ran := EditorInterface.is_playing_scene()
	var end := Time.get_ticks_msec() + 60000
	while not FileAccess.file_exists("res://played.txt") and Time.get_ticks_msec() < end:
		await get_tree().process_frame
	EditorInterface.stop_playing_scene()
	await frames(3)
	told["played"] = {"ran": ran, "stopped": not EditorInterface.is_playing_scene()}
