"""Players on the GPU: one is not lost by one image too large, is freed when nobody has it, and keeps to its thread."""

from __future__ import annotations

import gc
import threading
import weakref
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from avatar_runtime.backends.gl import GlBackend, gpu, make_scene
from avatar_runtime.camera import Camera
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.posed import Clock
from tests.avatars import full_avatar
from tests.runtime.backends.gl_cases import BACKGROUND, SIZE, camera, posed_of

AVATAR = full_avatar(3)
SMALL = Camera.orbit(np.zeros(3), 2.0, 0.0, 0.0, 0.5, 16, 16)


def test_an_image_too_large_is_refused_and_the_next_one_drawn() -> None:
    with Player(AVATAR, "gl") as player:
        before = player.frame(Pose(), SMALL).image.colour
        with pytest.raises(
            ValueError, match=r"^an image of 32768x1 pixels is larger than this context draws: \d"
        ):
            player.frame(Pose(), replace(SMALL, width=32768, height=1))
        assert np.array_equal(player.frame(Pose(), SMALL).image.colour, before)


@pytest.mark.parametrize("failing", ["texture", "depth_renderbuffer", "framebuffer"])
def test_an_image_that_the_driver_refuses_is_no_end(failing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where the GPU's memory is used up."""

    def refuse(*arguments: object, **named: object) -> None:
        raise moderngl.Error("no memory")

    with Player(AVATAR, "gl") as player:
        assert isinstance(player.backend, GlBackend)
        before = player.frame(Pose(), SMALL).image.colour
        held = len(player.backend.gpu.held)
        with monkeypatch.context() as patch:
            patch.setattr(player.backend.context, failing, refuse)
            with pytest.raises(
                AvatarError, match="backend gl: this context cannot draw 32x16 pixels into rgba32f"
            ):
                player.frame(Pose(), replace(SMALL, width=32))
        assert np.array_equal(player.frame(Pose(), SMALL).image.colour, before)
        assert len(player.backend.gpu.held) == held


def test_a_player_that_nobody_has_is_freed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without waiting for Python's search for circles."""
    gone = []
    real = gpu.let_go
    monkeypatch.setattr(gpu, "let_go", lambda context: (gone.append(context), real(context)))
    gc.disable()
    try:
        player = Player(AVATAR, "gl")
        player.frame(Pose(), SMALL)
        assert isinstance(player.backend, GlBackend)
        state = player.backend.gpu._state
        assert len(state.items) > 5
        del player
        assert not state.items and gone == [state.context]
    finally:
        gc.enable()


def test_close_frees_and_ends() -> None:
    with Player(AVATAR, "gl") as player:
        player.frame(Pose(), SMALL)
    assert isinstance(player.backend, GlBackend)
    assert not player.backend.gpu.held
    player.close()
    with pytest.raises(ValueError, match="this player is closed"):
        player.frame(Pose(), SMALL)
    with pytest.raises(ValueError, match="this player is closed"):
        player.backend.frame(posed_of(player.backend), camera(), BACKGROUND, "engine", Clock())
    with Player(AVATAR, "reference") as other:
        other.animate(Pose())
    with pytest.raises(ValueError, match="this player is closed"):
        other.animate(Pose())


def test_a_shared_context_lives_as_long_as_someone_plays_in_it() -> None:
    first = GlBackend(AVATAR)
    second = GlBackend(AVATAR, first.context)
    scene = make_scene([first, second])
    posed = [posed_of(first), posed_of(second)]
    want = scene.image(posed, camera()).colour
    context = weakref.ref(first.gpu)
    del first
    assert context() is not None  # the scene has it
    assert np.array_equal(scene.image(posed, camera()).colour, want)
    del scene
    assert context() is None
    image = second.frame(posed[1], camera(), BACKGROUND, "engine", Clock())
    assert image.colour.shape == (SIZE[1], SIZE[0], 3)
    second.release()


def test_another_thread_is_refused_by_its_name_for_the_fault() -> None:
    player, said = Player(AVATAR, "gl"), []

    def play() -> None:
        try:
            player.frame(Pose(), SMALL)
        except ValueError as error:
            said.append(str(error))

    before = player.frame(Pose(), SMALL).image.colour
    thread = threading.Thread(target=play)
    thread.start()
    thread.join()
    assert said == ["a player on backend gl plays in the thread that made it; make one in each thread"]
    assert np.array_equal(player.frame(Pose(), SMALL).image.colour, before)
    player.close()


def test_what_another_thread_drops_is_freed_when_its_own_plays_next() -> None:
    with Player(AVATAR, "gl") as other:
        kept = [Player(AVATAR, "gl")]
        backend = kept[0].backend
        assert isinstance(backend, GlBackend)
        state = backend.gpu._state
        del backend
        thread = threading.Thread(target=kept.clear)
        thread.start()
        thread.join()
        assert state.items
        other.frame(Pose(), SMALL)
        assert not state.items
