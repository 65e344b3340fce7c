# Poses every rigged .glb of a job. test_rig.py appends the fragments of docs/engines/godot.md: vertices_of_id, set_pose.
extends SceneTree


func _process(_seconds: float) -> bool:
	var job: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://job.json"))
	var answer := {}
	for file in job:
		answer[file] = asked(load("res://" + file).instantiate(), job[file], FileAccess.open("res://%s.f32" % file, FileAccess.WRITE))
	FileAccess.open("res://answer.json", FileAccess.WRITE).store_string(JSON.stringify(answer))
	return true


func asked(scene: Node3D, job: Dictionary, out: FileAccess) -> Dictionary:
	root.add_child(scene)
	var skeleton: Skeleton3D = scene.find_children("*", "Skeleton3D", true, false)[0]
	var mesh: MeshInstance3D = scene.find_children("*", "MeshInstance3D", true, false)[0]
	var player: AnimationPlayer = scene.find_children("*", "AnimationPlayer", true, false)[0]
	var top: Node3D = scene.find_child("avatar_root")
	var shapes := range(mesh.get_blend_shape_count()).map(func(k: int) -> String: return mesh.mesh.get_blend_shape_name(k))
	for pose in job.poses:
		rest(skeleton, mesh, top)
		set_pose({nodes = pose.nodes, weights = weights_by_name(shapes, pose.weights)}, skeleton, mesh, top)
		out.store_buffer(posed(mesh).to_byte_array())
	for clip in job.clips:
		rest(skeleton, mesh, top)
		player.play(clip.clip)
		for time in clip.times:
			player.seek(time, true)
			out.store_buffer(posed(mesh).to_byte_array())
		player.stop(true)
	var arrays := mesh.mesh.surface_get_arrays(0)
	var material: StandardMaterial3D = mesh.mesh.surface_get_material(0)
	var facts := {
		ids = vertices_of_id(mesh.mesh), triangles = Array(arrays[Mesh.ARRAY_INDEX]), shapes = shapes,
		joints = range(skeleton.get_bone_count()).map(skeleton.get_bone_name), clips = player.get_animation_list(),
		position = arrays[Mesh.ARRAY_VERTEX].to_byte_array().hex_encode(), uv = arrays[Mesh.ARRAY_TEX_UV].to_byte_array().hex_encode(),
		influences = arrays[Mesh.ARRAY_BONES].size() / arrays[Mesh.ARRAY_VERTEX].size(), root = top.get_class(),
		mode = mesh.mesh.blend_shape_mode, coloured = material.vertex_color_use_as_albedo and not material.vertex_color_is_srgb, keys = keys(player),
		bounds = [mesh.get_aabb().position, mesh.get_aabb().end].map(func(at: Vector3) -> Array: return [at.x, at.y, at.z]),
	}
	scene.free()
	return facts


func weights_by_name(names: Array, weights: Array) -> Dictionary:
	var named := {}
	for k in names.size():
		named[names[k]] = weights[k]
	return named


func rest(skeleton: Skeleton3D, mesh: MeshInstance3D, top: Node3D) -> void:
	skeleton.reset_bone_poses()
	top.transform = Transform3D.IDENTITY
	for k in mesh.get_blend_shape_count():
		mesh.set_blend_shape_value(k, 0)


# The vertices as the engine bakes them, its blend shapes first, then its skin; in the world.
func posed(mesh: MeshInstance3D) -> PackedVector3Array:
	mesh.get_parent().notification(Skeleton3D.NOTIFICATION_UPDATE_SKELETON)  # hands bones over now, not at the frame's end
	var arrays := mesh.bake_mesh_from_current_blend_shape_mix().surface_get_arrays(0)
	var weights: PackedFloat32Array = mesh.mesh.surface_get_arrays(0)[Mesh.ARRAY_WEIGHTS]
	for k in weights.size():
		weights[k] += 0.25 / 65535  # weights are cut to 16 bits: cut again, these stay the same
	arrays[Mesh.ARRAY_WEIGHTS] = weights
	var shaped: MeshInstance3D = mesh.duplicate()
	shaped.mesh = ArrayMesh.new()
	shaped.mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays, [], {}, mesh.mesh.surface_get_format(0) & Mesh.ARRAY_FLAG_USE_8_BONE_WEIGHTS)
	mesh.get_parent().add_child(shaped)
	var vertices: PackedVector3Array = shaped.bake_mesh_from_current_skeleton_pose().surface_get_arrays(0)[Mesh.ARRAY_VERTEX]
	shaped.free()
	return mesh.global_transform * vertices


# Clip -> keys of all its tracks together.
func keys(player: AnimationPlayer) -> Dictionary:
	var found := {}
	for clip in player.get_animation_list():
		var animation := player.get_animation(clip)
		var count := func(sum: int, track: int) -> int: return sum + animation.track_get_key_count(track)
		found[clip] = range(animation.get_track_count()).reduce(count, 0)
	return found
