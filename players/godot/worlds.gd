@tool
extends RefCounted
## Lets each world that has avatars draw them, whatever Compositors its user sets, at any time.
##
## A Compositor in force replaces all others. So before each frame a Compositor of our own is put in force instead,
## which holds the user's effects and then ours. That happens in the RenderingServer alone: no node and no resource of
## the user is changed, and nothing of it is saved.

const Self := preload("worlds.gd")
const Lights := preload("lights.gd")
const MOST_KEPT := 16  # compositors of ours for a world; then they are made anew

static var _only: Self

var _worlds: Dictionary[RID, World] = {}
var _cameras: Dictionary[Camera3D, RID] = {}  # all in the tree; the scenario for which it has a compositor of ours
var _lights: Array[Light3D] = []  # all in the tree
var _tree: SceneTree


## One world: its effect, its avatars, and a compositor of ours for each compositor of the user (null: none).
class World:
	var scenario: RID
	var effect: CompositorEffect
	var lights: Lights
	var avatars: Array[GaussianAvatar3D] = []
	var group: StringName  # of the nodes WorldEnvironment that have a compositor, the one in force first
	var ours: Dictionary[Compositor, Compositor] = {}
	var theirs: Dictionary[Compositor, Array] = {}
	var told: PackedStringArray = [""]  # lines of errors: each once

	func compositor(user: Compositor) -> Compositor:
		var effects: Array[CompositorEffect] = []
		if user != null:
			effects = user.compositor_effects
		if user in ours and theirs[user] == effects:
			return ours[user]
		if ours.size() >= MOST_KEPT:
			ours.clear()
		theirs[user] = effects.duplicate()
		effects.append(effect)
		ours[user] = Compositor.new()
		ours[user].compositor_effects = effects
		return ours[user]

	func tell() -> void:
		var line: String = effect.call(&"error")
		if line not in told:
			told.append(line)
			push_error(line)


## Shows an avatar in the world where it stands. Nothing happens where nothing can be drawn.
static func add(avatar: GaussianAvatar3D) -> void:
	if RenderingServer.get_rendering_device() == null:
		return
	if _only == null:
		_only = Self.new()
		_only._begin(avatar.get_tree())
	_only._add(avatar, avatar.get_world_3d().scenario)


## Shows it no longer.
static func remove(avatar: GaussianAvatar3D) -> void:
	if _only == null:
		return
	_only._remove(avatar)
	if _only._worlds.is_empty():
		_only._end()
		_only = null


## The effect that draws an avatar; null where nothing does.
static func effect_of(avatar: GaussianAvatar3D) -> CompositorEffect:
	var world := _only._world_of(avatar) if _only != null else null
	return world.effect if world != null else null


func _begin(tree: SceneTree) -> void:
	_tree = tree
	for camera: Camera3D in tree.root.find_children("*", "Camera3D", true, false):
		_cameras[camera] = RID()
	_lights.assign(tree.root.find_children("*", "Light3D", true, false))
	tree.node_added.connect(_node_added)
	tree.node_removed.connect(_node_removed)
	RenderingServer.frame_pre_draw.connect(_before_frame)


func _end() -> void:
	_tree.node_added.disconnect(_node_added)
	_tree.node_removed.disconnect(_node_removed)
	RenderingServer.frame_pre_draw.disconnect(_before_frame)


func _node_added(node: Node) -> void:
	if node is Camera3D:
		_cameras[node as Camera3D] = RID()
	elif node is Light3D:
		_lights.append(node as Light3D)


func _node_removed(node: Node) -> void:
	if node is Camera3D:
		_give_back(node as Camera3D)
		_cameras.erase(node as Camera3D)
	elif node is Light3D:
		_lights.erase(node as Light3D)


func _world_of(avatar: GaussianAvatar3D) -> World:
	for scenario in _worlds:
		if avatar in _worlds[scenario].avatars:
			return _worlds[scenario]
	return null


func _add(avatar: GaussianAvatar3D, scenario: RID) -> void:
	if scenario not in _worlds:
		var world := World.new()
		world.effect = GaussianAvatar.make_effect()
		if world.effect == null:
			return
		world.lights = Lights.new(world.effect)
		world.scenario = scenario
		world.group = "_world_compositor_%d" % scenario.get_id()
		_worlds[scenario] = world
	_worlds[scenario].avatars.append(avatar)
	_worlds[scenario].effect.call(&"add", avatar.core)


func _remove(avatar: GaussianAvatar3D) -> void:
	var world := _world_of(avatar)
	if world == null:
		return
	world.effect.call(&"remove", avatar.core)
	world.avatars.erase(avatar)
	if not world.avatars.is_empty():
		return
	_worlds.erase(world.scenario)
	var user := _compositor_in_force(world)
	RenderingServer.scenario_set_compositor(world.scenario, user.get_rid() if user != null else RID())
	for camera in _cameras:
		if _cameras[camera] == world.scenario:
			_give_back(camera)
	# A render thread that still draws with it keeps it until then.
	RenderingServer.call_on_render_thread(func() -> void: world.effect.call(&"release"))


func _compositor_in_force(world: World) -> Compositor:
	var node := _tree.get_first_node_in_group(world.group) as WorldEnvironment
	return node.compositor if node != null else null


func _give_back(camera: Camera3D) -> void:
	if not _cameras[camera].is_valid():
		return
	_cameras[camera] = RID()
	var user := camera.compositor
	RenderingServer.camera_set_compositor(camera.get_camera_rid(), user.get_rid() if user != null else RID())


## What the engine has been told since the last frame is told again: that costs nothing, and cannot be missed.
func _before_frame() -> void:
	for scenario in _worlds:
		var world := _worlds[scenario]
		for avatar in world.avatars:
			avatar.before_frame(world.effect)
		_shine(world)
		var compositor := world.compositor(_compositor_in_force(world))
		RenderingServer.scenario_set_compositor(scenario, compositor.get_rid())
		world.tell()
	for camera in _cameras:
		_before_frame_of(camera)


## Hands each avatar the light where it stands. Nothing is asked where none of them takes light.
func _shine(world: World) -> void:
	var is_asked := false
	for avatar in world.avatars:
		if avatar.takes_light():
			if not is_asked:
				world.lights.take_ambient(avatar.get_world_3d(), _lights)
			is_asked = true
			avatar.shine(world.effect, world.lights.on(avatar, _lights))
		else:
			avatar.shine(world.effect, PackedFloat32Array())


func _before_frame_of(camera: Camera3D) -> void:
	var user := camera.compositor
	if user == null:  # the engine has taken ours away, if there was one
		_cameras[camera] = RID()
		return
	var world: World = _worlds.get(camera.get_world_3d().scenario)
	if world == null:
		_give_back(camera)
		return
	_cameras[camera] = world.scenario
	RenderingServer.camera_set_compositor(camera.get_camera_rid(), world.compositor(user).get_rid())
