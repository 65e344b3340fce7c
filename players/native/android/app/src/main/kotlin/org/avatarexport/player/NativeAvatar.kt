package org.avatarexport.player

/** The functions of avatar_jni.cpp. Call all but `close` on the thread of the GL surface. */
object NativeAvatar {
    init {
        System.loadLibrary("avatar_android")
    }

    /** A handle of a pack's bytes, also where it is not sound: then `error` has the line. */
    external fun open(file: ByteArray, name: String): Long

    /** The newest line, or null. */
    fun error(handle: Long): String? = line(handle)?.toString(Charsets.UTF_8)

    private external fun line(handle: Long): ByteArray?

    /** To be called whenever the GL context is a new one. */
    external fun contextMade(handle: Long)

    /** Draws one frame into the surface. Angles in radians; `clip` -1 is the pose at rest. */
    external fun draw(
        handle: Long,
        width: Int,
        height: Int,
        turn: Double,
        tilt: Double,
        zoom: Double,
        clip: Int,
        seconds: Double,
    ): Boolean

    /** Length of a clip; below 0 where there is none. */
    external fun clipSeconds(handle: Long, clip: Int): Double

    /** Frees everything, once the GL thread has ended and its context with it. */
    external fun close(handle: Long)
}
