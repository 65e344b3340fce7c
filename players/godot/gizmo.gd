@tool
extends EditorNode3DGizmoPlugin
## A click into the box of an avatar at rest selects it.


func _get_gizmo_name() -> String:
	return "GaussianAvatar3D"


func _has_gizmo(node: Node3D) -> bool:
	return node is GaussianAvatar3D


func _redraw(gizmo: EditorNode3DGizmo) -> void:
	gizmo.clear()
	var node := gizmo.get_node_3d() as GaussianAvatar3D
	if node.core == null:
		return
	var box := BoxMesh.new()
	box.size = node.facts["whole_size"]
	var triangles := TriangleMesh.new()
	triangles.create_from_faces(Transform3D(Basis.IDENTITY, node.facts["whole_target"]) * box.get_faces())
	gizmo.add_collision_triangles(triangles)
