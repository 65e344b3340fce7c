package org.avatarexport.player

import android.app.Activity
import android.os.Bundle
import android.widget.TextView
import java.io.IOException

/** Shows assets/head.avatar, or the line that says why it cannot. */
class MainActivity : Activity() {
    private var view: AvatarView? = null

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        val file = try {
            assets.open(FILE).use { it.readBytes() }
        } catch (missing: IOException) {
            return show("$FILE is not in the app: put it into app/src/main/assets (${missing.message})")
        }
        view = AvatarView(this, AvatarRenderer(file, FILE) { line -> runOnUiThread { show(line) } })
        setContentView(view)
    }

    override fun onResume() {
        super.onResume()
        view?.onResume()
    }

    override fun onPause() {
        view?.onPause()
        super.onPause()
    }

    private fun show(line: String) {
        view = null
        setContentView(TextView(this).apply { text = line })
    }

    private companion object {
        const val FILE = "head.avatar"
    }
}
