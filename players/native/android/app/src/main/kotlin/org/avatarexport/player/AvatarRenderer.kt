package org.avatarexport.player

import android.opengl.GLES31
import android.opengl.GLSurfaceView
import android.os.SystemClock
import javax.microedition.khronos.egl.EGLConfig
import javax.microedition.khronos.opengles.GL10

/** Plays the first clip of a pack in a loop. `onFailure` gets the line of a failure, once. */
class AvatarRenderer(private val file: ByteArray, private val name: String, private val onFailure: (String) -> Unit) :
    GLSurfaceView.Renderer {
    /** Radians and a factor; the thread of the screen writes them. */
    @Volatile var turn = 0.0
    @Volatile var tilt = 0.0
    @Volatile var zoom = 1.0

    private var handle = 0L
    private var width = 1
    private var height = 1
    private var failed = false

    override fun onSurfaceCreated(gl: GL10?, config: EGLConfig?) {
        if (handle == 0L) handle = NativeAvatar.open(file, name)
        NativeAvatar.contextMade(handle)
        reportFailure()
    }

    override fun onSurfaceChanged(gl: GL10?, width: Int, height: Int) {
        this.width = width
        this.height = height
    }

    override fun onDrawFrame(gl: GL10?) {
        GLES31.glClear(GLES31.GL_COLOR_BUFFER_BIT)
        val length = NativeAvatar.clipSeconds(handle, 0)
        val clip = if (length > 0) 0 else -1
        val seconds = if (length > 0) SystemClock.uptimeMillis() / 1000.0 % length else 0.0
        if (!failed && !NativeAvatar.draw(handle, width, height, turn, tilt, zoom, clip, seconds)) reportFailure()
    }

    /** Frees the avatar, after the GL thread has ended. A new surface opens it again. */
    fun close() {
        if (handle != 0L) NativeAvatar.close(handle)
        handle = 0L
        failed = false
    }

    private fun reportFailure() {
        val line = NativeAvatar.error(handle) ?: return
        if (!failed) onFailure(line)
        failed = true
    }
}
