@tool
extends EditorPlugin
## Adds to the editor: the importer of NAME.avatar, its pictures, clicks on avatars, and a menu item that checks this machine's GPU.

const Importer := preload("importer.gd")
const Preview := preload("preview.gd")
const Conform := preload("conform.gd")
const Gizmo := preload("gizmo.gd")
const MENU_ITEM := "Conform Gaussian Avatar..."

var _importer: Importer
var _preview: Preview
var _gizmo: Gizmo
var _dialog: EditorFileDialog


func _enter_tree() -> void:
	_importer = Importer.new()
	add_import_plugin(_importer)
	_preview = Preview.new()
	EditorInterface.get_resource_previewer().add_preview_generator(_preview)
	_gizmo = Gizmo.new()
	add_node_3d_gizmo_plugin(_gizmo)
	add_tool_menu_item(MENU_ITEM, _choose)


func _exit_tree() -> void:
	remove_tool_menu_item(MENU_ITEM)
	EditorInterface.get_resource_previewer().remove_preview_generator(_preview)
	remove_node_3d_gizmo_plugin(_gizmo)
	remove_import_plugin(_importer)
	if _dialog != null:
		_dialog.queue_free()


func _choose() -> void:
	if _dialog == null:
		_dialog = EditorFileDialog.new()
		_dialog.title = Conform.REMEDY
		_dialog.file_mode = EditorFileDialog.FILE_MODE_OPEN_DIR
		_dialog.access = EditorFileDialog.ACCESS_FILESYSTEM
		_dialog.dir_selected.connect(_conform)
		EditorInterface.get_base_control().add_child(_dialog)
	_dialog.popup_file_dialog()


func _conform(folder: String) -> void:
	Conform.run(folder)
