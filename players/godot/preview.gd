@tool
extends EditorResourcePreviewGenerator
## The picture in a file is the icon of what was imported from it. The importer put it beside the scene.


func _handles(type: String) -> bool:
	return type == "PackedScene"


func _generate_from_path(path: String, size: Vector2i, _metadata: Dictionary) -> Texture2D:
	var told := ConfigFile.new()
	if path.get_extension() != "avatar" or told.load(path + ".import") != OK:
		return null
	var picture := FileAccess.get_file_as_bytes((told.get_value("remap", "path", "") as String).get_basename() + ".webp")
	var image := Image.new()
	if picture.is_empty() or image.load_webp_from_buffer(picture) != OK:
		return null
	var share := minf(float(size.x) / image.get_width(), float(size.y) / image.get_height())
	image.resize(maxi(1, roundi(image.get_width() * share)), maxi(1, roundi(image.get_height() * share)), Image.INTERPOLATE_LANCZOS)
	return ImageTexture.create_from_image(image)


func _generate_small_preview_automatically() -> bool:
	return true
