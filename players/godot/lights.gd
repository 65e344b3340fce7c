@tool
extends RefCounted
## The light of a world on an avatar: up to four lights of the scene tree, the strongest there, and the ambient light.
##
## Units need no table: a light of energy 1 that faces a white matt surface is white there, and that is what avatars count in.

const MOST := 4
const SKY_ROWS := 32  # of a panorama of what a matt surface reflects
const SKY_FRAMES := 32  # the engine filters a sky over some frames: it is read again for as long
const SKY_EVERY := 8  # frames: reading waits for the GPU
const AMBIENT := 27  # numbers: nine rows of SH

var _effect: CompositorEffect
var _ambient := PackedFloat32Array()
var _made_of: Array = []  # `_ambient`
var _is_known := false  # a sky is not, until the engine has drawn it
var _changed := -2  # frame
var _sky_until := -1  # frame
var _sky_next := 0  # frame
var _best: Array[Light3D] = [null, null, null, null]
var _strength := PackedFloat64Array([0.0, 0.0, 0.0, 0.0])


func _init(effect: CompositorEffect) -> void:
	_effect = effect
	_ambient.resize(AMBIENT)


## Once a frame: takes the ambient light of a world.
func take_ambient(world: World3D, all: Array[Light3D]) -> void:
	var environment := _environment(world)
	var made_of: Array = _values(environment)
	if _reads_sky(environment):
		for light in all:  # a sky may have a sun
			if light is DirectionalLight3D and _shines(light, world):
				made_of.append_array([light.global_basis.z, light.light_color, light.light_energy])
	var frame := Engine.get_frames_drawn()
	if made_of != _made_of:
		_made_of = made_of
		if frame > _changed + 1:
			_sky_next = frame  # at once, but not in each frame of one that goes on changing
		_changed = frame
		_sky_until = frame + SKY_FRAMES
		if not _reads_sky(environment):
			_take_colour(environment)
			_is_known = true
	if not _reads_sky(environment) or frame > _sky_until or frame < _sky_next:
		return
	var is_drawn := _take_sky(environment)
	_is_known = _is_known or is_drawn or frame >= _changed + SKY_EVERY
	_sky_next = frame + (SKY_EVERY if is_drawn or frame + SKY_EVERY > _sky_until else 1)


## The numbers of GaussianAvatarEffect.set_light; none where the world has neither lights nor an environment: nobody has
## lit it yet, so the avatar is shown as it was captured.
func on(avatar: GaussianAvatar3D, all: Array[Light3D]) -> PackedFloat32Array:
	var numbers := PackedFloat32Array()
	var world := avatar.get_world_3d()
	var middle := avatar.middle()
	var is_lit := _environment(world) != null
	_best.fill(null)
	_strength.fill(0.0)
	for light in all:
		if light.get_world_3d() != world:
			continue
		is_lit = true
		if _shines(light, world) and light.light_cull_mask & avatar.layers:
			_rank(light, energy_at(light, middle))
	if not is_lit or not _is_known:
		return numbers
	var shadow := _caster_first()
	numbers.append(1.0 if shadow else 0.0)
	numbers.append_array(_ambient)
	for i in MOST:
		if _best[i] != null:
			_append(numbers, _best[i], _strength[i], middle)
	return numbers


## What of a light's energy arrives at a place, by the engine's formulas for lamps.
static func energy_at(light: Light3D, at: Vector3) -> float:
	if light is DirectionalLight3D:
		return light.light_energy
	var away := at - light.global_position
	var distance := maxf(away.length(), 0.0001)
	var lamp := light as OmniLight3D
	if lamp != null:
		return light.light_energy * _left(distance, lamp.omni_range, lamp.omni_attenuation)
	var spot := light as SpotLight3D
	var edge := cos(deg_to_rad(spot.spot_angle))
	var inside := maxf(-light.global_basis.z.normalized().dot(away / distance), edge)
	var rim := maxf((1.0 - inside) / (1.0 - edge), 0.0001)
	return light.light_energy * _left(distance, spot.spot_range, spot.spot_attenuation) * (1.0 - pow(rim, spot.spot_angle_attenuation))


static func _left(distance: float, reach: float, decay: float) -> float:
	var window := maxf(1.0 - pow(distance / reach, 4.0), 0.0)
	return window * window * pow(distance, -decay)


static func _shines(light: Light3D, world: World3D) -> bool:
	if light.get_world_3d() != world or not light.is_visible_in_tree() or light.light_negative:
		return false
	if light.editor_only and not Engine.is_editor_hint():
		return false
	return not (light is DirectionalLight3D and light.sky_mode == DirectionalLight3D.SKY_MODE_SKY_ONLY)


## Puts a light among the strongest, the strongest first.
func _rank(light: Light3D, energy: float) -> void:
	for i in MOST:
		if energy * light.light_color.get_luminance() <= _strength_shown(i):
			continue
		for k in range(MOST - 1, i, -1):
			_best[k] = _best[k - 1]
			_strength[k] = _strength[k - 1]
		_best[i] = light
		_strength[i] = energy
		return


func _strength_shown(i: int) -> float:
	return _strength[i] * _best[i].light_color.get_luminance() if _best[i] != null else 0.0


## The first of the lights is the one that casts a shadow: the strongest of those that shall. False: none shall.
func _caster_first() -> bool:
	for i in MOST:
		if _best[i] == null or not _best[i].shadow_enabled:
			continue
		var light := _best[i]
		var energy := _strength[i]
		_best[i] = _best[0]
		_strength[i] = _strength[0]
		_best[0] = light
		_strength[0] = energy
		return true
	return false


## Avatars let a lamp fall off with the square of the distance: it is as strong as the engine's at the avatar's middle.
func _append(numbers: PackedFloat32Array, light: Light3D, energy: float, middle: Vector3) -> void:
	var is_lamp := light is not DirectionalLight3D
	var place := light.global_position if is_lamp else light.global_basis.z.normalized()
	var colour := light.light_color.srgb_to_linear() * (energy * (place.distance_squared_to(middle) if is_lamp else 1.0))
	numbers.append_array([place.x, place.y, place.z, colour.r, colour.g, colour.b, 1.0 if is_lamp else 0.0])


static func _environment(world: World3D) -> Environment:
	return world.environment if world.environment != null else world.fallback_environment


static func _values(environment: Environment) -> Array:
	if environment == null:
		return [null]
	return [
		environment, environment.background_mode, environment.background_color, environment.background_energy_multiplier,
		environment.ambient_light_source, environment.ambient_light_color, environment.ambient_light_energy,
		environment.ambient_light_sky_contribution, environment.sky, environment.sky_rotation,
		RenderingServer.get_default_clear_color(),
	]


static func _reads_sky(environment: Environment) -> bool:
	if environment == null or environment.sky == null:
		return false
	var source := environment.ambient_light_source
	var is_behind := environment.background_mode == Environment.BG_SKY
	return source == Environment.AMBIENT_SOURCE_SKY or (source == Environment.AMBIENT_SOURCE_BG and is_behind)


## Ambient light that is the same from all sides.
func _take_colour(environment: Environment) -> void:
	var colour := Color.BLACK
	if environment != null and environment.ambient_light_source == Environment.AMBIENT_SOURCE_BG:
		if environment.background_mode == Environment.BG_COLOR:
			colour = environment.background_color.srgb_to_linear() * environment.background_energy_multiplier
		elif environment.background_mode == Environment.BG_CLEAR_COLOR:
			colour = RenderingServer.get_default_clear_color().srgb_to_linear() * environment.background_energy_multiplier
	elif environment != null and environment.ambient_light_source == Environment.AMBIENT_SOURCE_COLOR:
		colour = environment.ambient_light_color.srgb_to_linear() * environment.ambient_light_energy
	_ambient.fill(0.0)
	for channel in 3:
		_ambient[channel] = colour[channel] * sqrt(4.0 * PI)  # the first basis of SH is its inverse


## Of what the engine's own materials take from the sky. False: it is black, or the engine has not drawn it yet.
func _take_sky(environment: Environment) -> bool:
	var size := Vector2i(2 * SKY_ROWS, SKY_ROWS)
	var panorama := RenderingServer.environment_bake_panorama(environment.get_rid(), true, size)
	if panorama == null or panorama.is_empty():
		return false
	panorama.convert(Image.FORMAT_RGBAF)
	var turn := Basis.from_euler(environment.sky_rotation)
	_ambient = _effect.call(&"rows_of_panorama", panorama.get_data(), SKY_ROWS, Transform3D(turn))
	return _ambient[0] + _ambient[1] + _ambient[2] > 0.0
