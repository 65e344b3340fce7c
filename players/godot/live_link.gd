@icon("icon.svg")
class_name LiveLinkFace
extends Node
## Receives the app Live Link Face over UDP and drives an avatar. In the app's settings add the address of this machine
## as a target, with the same port.

const MOST_PACKETS := 64  # a frame: a flood must not stop it

## A face was read: 61 numbers, as [method GaussianAvatar3D.drive] takes them.
signal received(channels: PackedFloat32Array)

## The avatar to drive; nothing: the node above.
@export var avatar: GaussianAvatar3D

## UDP port; the app's own is 11111.
@export_range(1, 65535) var port := 11111:
	set(value):
		port = value
		if is_inside_tree():
			_listen()

## Address to listen at; "*" is all of this machine.
@export var address := "*"

## How many faces were received.
var received_count := 0

var _socket := PacketPeerUDP.new()
var _reader: RefCounted


func _enter_tree() -> void:
	_reader = GaussianAvatar.make_core()
	_listen()


func _exit_tree() -> void:
	_socket.close()


func _listen() -> void:
	_socket.close()
	var failed := _socket.bind(port, address)
	if failed != OK:
		push_error("%s cannot listen on UDP port %d: %s. Choose another port here and in the app" % [name, port, error_string(failed)])


func _process(_delta: float) -> void:
	var newest := PackedFloat32Array()
	for i in MOST_PACKETS:
		if _reader == null or _socket.get_available_packet_count() == 0:
			break
		var channels: PackedFloat32Array = _reader.call(&"read_packet", _socket.get_packet())
		if not channels.is_empty():
			newest = channels
			received_count += 1
	if newest.is_empty():
		return
	received.emit(newest)
	var driven := avatar if avatar != null else get_parent() as GaussianAvatar3D
	if driven != null:
		var line := driven.drive(newest)
		if not line.is_empty():
			push_error(line)
			set_process(false)
