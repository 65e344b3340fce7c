extends CompositorEffect
## An effect of a user: counts how often it is called.

var calls := 0


func _render_callback(_type: int, _data: RenderData) -> void:
	calls += 1
