@tool
extends SceneTree
## Runs every stage on this machine's GPU and compares it with the vectors of `avatar-export pack --reference`:
## [code]godot --path PROJECT --script addons/gaussian_avatar/conform.gd -- FOLDER[/code]. Ends with 0 where all agree,
## with 1 where something differs, with 2 where it could not be run.

const SUFFIX := ".reference"
const REMEDY := "choose the folder NAME.reference that `avatar-export pack --reference` writes beside NAME.avatar"


func _initialize() -> void:
	var folders := OS.get_cmdline_user_args()
	if folders.size() != 1:
		printerr("Say which folder: ", REMEDY)
		quit(2)
	else:
		quit(run(folders[0]))


## Prints a line for each row, and the device; returns what the command ends with.
static func run(folder: String) -> int:
	folder = folder.trim_suffix("/").trim_suffix("\\")
	if not folder.ends_with(SUFFIX):
		printerr(folder.get_file(), ": is no NAME.reference; ", REMEDY)
		return 2
	print("Gaussian Avatar on ", RenderingServer.get_video_adapter_name(), ", Godot ", Engine.get_version_info()["string"])
	var whole := folder.trim_suffix(SUFFIX) + ".avatar"
	var results: Array[Dictionary] = []
	if FileAccess.file_exists(folder.path_join("driving.json")):  # else ARKit does not drive it
		results.append(_conform(whole, folder.path_join("driving.json"), folder.path_join("driving.safetensors")))
	results.append(_conform(folder.path_join("mini.avatar"), folder.path_join("cases.json"), folder.path_join("vectors.safetensors")))
	var differ := 0
	var count := 0
	for result in results:
		var line: String = result["error"]
		if not line.is_empty():
			printerr(line)
			return 2
		for row: Dictionary in result["rows"]:
			print(_text(row))
			count += 1
			differ += int(not row["passed"])
	print("%d of %d outputs differ" % [differ, count] if differ > 0 else "all %d outputs agree" % count)
	return mini(differ, 1)


static func _conform(pack: String, cases: String, vectors: String) -> Dictionary:
	for path: String in [pack, cases, vectors]:
		if not FileAccess.file_exists(path):
			return {"error": "%s: cannot be read; %s" % [path.get_file(), REMEDY]}
	var core: RefCounted = GaussianAvatar.make_core()
	if core == null:
		return {"error": GaussianAvatar3D.NO_EXTENSION}
	var line: String = core.call(&"load", FileAccess.get_file_as_bytes(pack), pack.get_file())
	if not line.is_empty():
		return {"error": line}
	return core.call(&"conform", FileAccess.get_file_as_string(cases), FileAccess.get_file_as_bytes(vectors))


static func _text(row: Dictionary) -> String:
	var verdict := "ok     " if row["passed"] else "DIFFERS"
	return "%s %-10s %-18s %6.1f %% of the tolerance, %d flips, case %s" % [
		verdict, row["stage"], row["output"], 100.0 * row["used"], row["flips"], row["name"]
	]
