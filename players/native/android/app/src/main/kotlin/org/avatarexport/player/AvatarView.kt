package org.avatarexport.player

import android.annotation.SuppressLint
import android.content.Context
import android.opengl.GLSurfaceView
import android.view.MotionEvent
import android.view.ScaleGestureDetector

/** A finger turns the avatar, two fingers move the camera nearer. */
@SuppressLint("ViewConstructor")
class AvatarView(context: Context, private val avatar: AvatarRenderer) : GLSurfaceView(context) {
    private var lastX = 0f
    private var lastY = 0f
    private val pinch = ScaleGestureDetector(
        context,
        object : ScaleGestureDetector.SimpleOnScaleGestureListener() {
            override fun onScale(detector: ScaleGestureDetector): Boolean {
                avatar.zoom = (avatar.zoom * detector.scaleFactor).coerceIn(0.5, 8.0)
                return true
            }
        },
    )

    init {
        setEGLContextClientVersion(3) // drivers give their newest 3.x; the player says it where that is below 3.1
        setEGLConfigChooser(8, 8, 8, 8, 0, 0)
        preserveEGLContextOnPause = true
        setRenderer(avatar)
    }

    @SuppressLint("ClickableViewAccessibility")
    override fun onTouchEvent(event: MotionEvent): Boolean {
        pinch.onTouchEvent(event)
        if (event.actionMasked == MotionEvent.ACTION_MOVE && event.pointerCount == 1 && !pinch.isInProgress) {
            avatar.turn -= (event.x - lastX) * RADIANS_PER_PIXEL
            avatar.tilt = (avatar.tilt + (event.y - lastY) * RADIANS_PER_PIXEL).coerceIn(-1.4, 1.4)
        }
        lastX = event.x
        lastY = event.y
        return true
    }

    override fun onDetachedFromWindow() {
        super.onDetachedFromWindow() // waits for the end of the GL thread
        avatar.close()
    }

    private companion object {
        const val RADIANS_PER_PIXEL = 0.005
    }
}
