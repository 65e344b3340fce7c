// What NativeAvatar.kt calls. A handle is an App, as a number; 0 is taken and does nothing. All calls come from the
// thread of the GL surface.
#include <EGL/egl.h>
#include <jni.h>

#include <cmath>
#include <cstring>
#include <new>

#include "avatar_gles.h"

namespace {

constexpr double field_of_view = 0.5;  // radians, vertical
constexpr float background[3] = {0.1F, 0.1F, 0.1F};

struct App {
    AvatarPack* pack = nullptr;
    AvatarInstance* instance = nullptr;
    AvatarGles* gles = nullptr;
    AvatarFacts facts = {};
    const char* camera_line = nullptr;  // why there was no camera
};

App* app_of(jlong handle) { return reinterpret_cast<App*>(handle); }

AvatarGlesFunction load(const char* name) { return eglGetProcAddress(name); }

/// The newest line, or null.
const char* line_of(const App* app) {
    const char* line = avatar_error(app->pack);
    if (line == nullptr) line = avatar_instance_error(app->instance);  // also where it is null
    if (line == nullptr && app->gles != nullptr) line = avatar_gles_error(app->gles);
    return line == nullptr ? app->camera_line : line;
}

}  // namespace

extern "C" {

/// 0 where Java has no memory: then an exception is on its way to Kotlin, and no other function of Java may be called.
JNIEXPORT jlong JNICALL Java_org_avatarexport_player_NativeAvatar_open(JNIEnv* env, jobject, jbyteArray file, jstring name) {
    const char* called = env->GetStringUTFChars(name, nullptr);
    if (called == nullptr) return 0;
    App* app = nullptr;
    jbyte* bytes = env->GetByteArrayElements(file, nullptr);
    if (bytes != nullptr) {
        app = new (std::nothrow) App;
        if (app != nullptr) {
            app->pack = avatar_load(bytes, static_cast<size_t>(env->GetArrayLength(file)), called, nullptr);
            if (avatar_error(app->pack) == nullptr) {
                avatar_facts(app->pack, &app->facts);
                app->instance = avatar_instance_open(app->pack, 0, nullptr);
            }
        }
        env->ReleaseByteArrayElements(file, bytes, JNI_ABORT);
    }
    env->ReleaseStringUTFChars(name, called);
    return reinterpret_cast<jlong>(app);
}

/// The newest line as UTF-8, or null. (NewStringUTF takes another encoding, and ends the app at a name with an emoji.)
JNIEXPORT jbyteArray JNICALL Java_org_avatarexport_player_NativeAvatar_line(JNIEnv* env, jobject, jlong handle) {
    const char* line = handle == 0 ? "takes more memory than there is" : line_of(app_of(handle));
    if (line == nullptr) return nullptr;
    const auto size = static_cast<jsize>(std::strlen(line));
    const jbyteArray made = env->NewByteArray(size);
    if (made != nullptr) env->SetByteArrayRegion(made, 0, size, reinterpret_cast<const jbyte*>(line));
    return made;
}

/// The GL context is new: of the first surface, or of another one, after the system took the first away.
JNIEXPORT void JNICALL Java_org_avatarexport_player_NativeAvatar_contextMade(JNIEnv*, jobject, jlong handle) {
    App* app = app_of(handle);
    if (app == nullptr || app->instance == nullptr) return;
    if (app->gles != nullptr) {
        avatar_gles_forget(app->gles);
        avatar_gles_restore(app->gles);
        return;
    }
    app->gles = avatar_gles_open(load, nullptr);
    if (avatar_gles_error(app->gles) == nullptr) avatar_gles_add(app->gles, app->pack, app->instance);
}

/// One frame into the surface. `turn` and `tilt` radians, `zoom` 1 shows the whole avatar; `clip` -1: the pose at rest.
JNIEXPORT jboolean JNICALL Java_org_avatarexport_player_NativeAvatar_draw(JNIEnv*, jobject, jlong handle, jint width, jint height,
                                                                          jdouble turn, jdouble tilt, jdouble zoom, jint clip,
                                                                          jdouble seconds) {
    App* app = app_of(handle);
    if (app == nullptr || app->gles == nullptr) return JNI_FALSE;
    if (clip < 0) {
        avatar_reset_pose(app->instance);
    } else {
        avatar_clip_pose(app->instance, static_cast<uint32_t>(clip), seconds);
    }
    AvatarCamera camera;
    const double reach = std::fmax(app->facts.whole_size[0] * height / width, app->facts.whole_size[1]);
    const double distance = 0.6 * reach / std::tan(field_of_view / 2) / zoom;
    app->camera_line =
        avatar_camera_orbit(&camera, app->facts.whole_target, distance, turn, tilt, field_of_view, width, height);
    if (app->camera_line != nullptr) return JNI_FALSE;
    const double tall = avatar_height_px(app->instance, &camera);
    avatar_set_level(app->instance, avatar_next_level(app->pack, tall, avatar_instance_level(app->instance)));
    const bool drawn = avatar_gles_pose(app->gles) == AVATAR_OK && avatar_gles_draw(app->gles, &camera, nullptr) == AVATAR_OK &&
                       avatar_gles_composite(app->gles, 0, background, 0) == AVATAR_OK;
    return drawn ? JNI_TRUE : JNI_FALSE;
}

/// Of a clip; below 0: there is no such clip.
JNIEXPORT jdouble JNICALL Java_org_avatarexport_player_NativeAvatar_clipSeconds(JNIEnv*, jobject, jlong handle, jint clip) {
    AvatarClip found = {};
    const App* app = app_of(handle);
    if (app == nullptr || app->instance == nullptr || clip < 0) return -1;
    return avatar_clip(app->pack, static_cast<uint32_t>(clip), &found) == AVATAR_OK ? found.seconds : -1;
}

/// After the context is gone: nothing is left in it to delete, and this thread has no other.
JNIEXPORT void JNICALL Java_org_avatarexport_player_NativeAvatar_close(JNIEnv*, jobject, jlong handle) {
    App* app = app_of(handle);
    if (app == nullptr) return;
    avatar_gles_forget(app->gles);
    avatar_gles_close(app->gles);
    avatar_instance_close(app->instance);
    avatar_close(app->pack);
    delete app;
}

}  // extern "C"
