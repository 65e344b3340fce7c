// A stand-in for Android's jni.h: what avatar_jni.cpp uses, for tests. Nothing here runs.
#pragma once
#include <cstdint>

#define JNIEXPORT
#define JNICALL
#define JNI_ABORT 2
#define JNI_TRUE 1
#define JNI_FALSE 0

using jint = std::int32_t;
using jlong = std::int64_t;
using jbyte = std::int8_t;
using jdouble = double;
using jboolean = std::uint8_t;
using jsize = jint;
struct JniObjectStub;
using jobject = JniObjectStub*;
using jstring = JniObjectStub*;
using jbyteArray = JniObjectStub*;

struct JNIEnv {
    const char* GetStringUTFChars(jstring text, jboolean* copied);
    void ReleaseStringUTFChars(jstring text, const char* given);
    jbyteArray NewByteArray(jsize length);
    void SetByteArrayRegion(jbyteArray array, jsize first, jsize length, const jbyte* bytes);
    jsize GetArrayLength(jbyteArray array);
    jbyte* GetByteArrayElements(jbyteArray array, jboolean* copied);
    void ReleaseByteArrayElements(jbyteArray array, jbyte* given, jint mode);
};
