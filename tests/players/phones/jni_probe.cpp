// Calls avatar_jni.cpp as Kotlin would, with a stand-in for Java and for OpenGL, and prints what was called.
#include <cstdio>
#include <cstring>
#include <string>

#include <jni.h>

#include "avatar_gles.h"

struct JniObjectStub {
    std::string bytes;
    bool full;  // there is no memory to read it: Java has an exception then
};

static bool thrown = false;
static void called(const char* name) {
    if (thrown) std::printf("%s with an exception\n", name);
}

const char* JNIEnv::GetStringUTFChars(jstring text, jboolean*) {
    called("GetStringUTFChars");
    thrown = text->full;
    return text->full ? nullptr : text->bytes.c_str();
}
void JNIEnv::ReleaseStringUTFChars(jstring, const char*) {}
jsize JNIEnv::GetArrayLength(jbyteArray array) {
    called("GetArrayLength");
    return static_cast<jsize>(array->bytes.size());
}
jbyte* JNIEnv::GetByteArrayElements(jbyteArray array, jboolean*) {
    called("GetByteArrayElements");
    thrown = array->full;
    return array->full ? nullptr : reinterpret_cast<jbyte*>(&array->bytes[0]);
}
void JNIEnv::ReleaseByteArrayElements(jbyteArray, jbyte*, jint) {}
static JniObjectStub made;
jbyteArray JNIEnv::NewByteArray(jsize length) {
    made.bytes.resize(static_cast<size_t>(length));
    return &made;
}
void JNIEnv::SetByteArrayRegion(jbyteArray array, jsize first, jsize length, const jbyte* bytes) {
    std::memcpy(&array->bytes[static_cast<size_t>(first)], bytes, static_cast<size_t>(length));
}

struct AvatarGles {};
AvatarGles* avatar_gles_open(AvatarGlesLoad, const AvatarAllocator*) { std::puts("gles open"); return new AvatarGles; }
void avatar_gles_close(AvatarGles* gles) { if (gles != nullptr) std::puts("gles close"); delete gles; }
void avatar_gles_forget(AvatarGles* gles) { if (gles != nullptr) std::puts("gles forget"); }
int avatar_gles_restore(AvatarGles*) { std::puts("gles restore"); return AVATAR_OK; }
const char* avatar_gles_error(const AvatarGles*) { return nullptr; }
int avatar_gles_add(AvatarGles*, const AvatarPack*, AvatarInstance*) { std::puts("gles add"); return AVATAR_OK; }
int avatar_gles_pose(AvatarGles*) { return AVATAR_OK; }
int avatar_gles_draw(AvatarGles*, const AvatarCamera*, const AvatarGlesDepth*) { return AVATAR_OK; }
int avatar_gles_composite(AvatarGles*, uint32_t, const float*, int) { return AVATAR_OK; }
extern "C" void (*eglGetProcAddress(const char*))(void) { return nullptr; }

#define KOTLIN(name) Java_org_avatarexport_player_NativeAvatar_##name
extern "C" {
jlong KOTLIN(open)(JNIEnv*, jobject, jbyteArray, jstring);
jbyteArray KOTLIN(line)(JNIEnv*, jobject, jlong);
void KOTLIN(contextMade)(JNIEnv*, jobject, jlong);
jboolean KOTLIN(draw)(JNIEnv*, jobject, jlong, jint, jint, jdouble, jdouble, jdouble, jint, jdouble);
jdouble KOTLIN(clipSeconds)(JNIEnv*, jobject, jlong, jint);
void KOTLIN(close)(JNIEnv*, jobject, jlong);
}

/// Argument: the file of a sound pack.
int main(int, char** given) {
    JNIEnv java;
    JniObjectStub file = {"", false}, name = {"h\xF0\x9F\x98\x80.avatar", false};
    char part[4096];
    std::FILE* opened = std::fopen(given[1], "rb");
    for (size_t size; (size = std::fread(part, 1, sizeof(part), opened)) > 0;) file.bytes.append(part, size);
    std::fclose(opened);
    for (JniObjectStub* full : {&name, &file}) {
        full->full = true;
        std::printf("no memory: %d\n", KOTLIN(open)(&java, nullptr, &file, &name) == 0);
        thrown = full->full = false;
    }
    JniObjectStub cut = {file.bytes.substr(0, 99), false};
    for (JniObjectStub* one : {&cut, &file}) {
        const jlong handle = KOTLIN(open)(&java, nullptr, one, &name);
        for (int context = 0; context < 2; ++context) KOTLIN(contextMade)(&java, nullptr, handle);
        std::printf("drawn: %d\n", KOTLIN(draw)(&java, nullptr, handle, 640, 480, 0.1, 0.2, 1, 0, 0.05));
        std::printf("not drawn: %d\n", KOTLIN(draw)(&java, nullptr, handle, 0, 480, 0.1, 0.2, 1, -1, 0));
        std::printf("seconds: %.4f %.1f\n", KOTLIN(clipSeconds)(&java, nullptr, handle, 0), KOTLIN(clipSeconds)(&java, nullptr, handle, 99));
        const jbyteArray line = KOTLIN(line)(&java, nullptr, handle);
        std::printf("line: %s\n", line == nullptr ? "" : line->bytes.c_str());
        KOTLIN(close)(&java, nullptr, handle);
    }
    return 0;
}
