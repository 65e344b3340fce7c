#include "gl.h"

namespace avatar {

/// A function of type F by its name. The one type stands for all pointers to functions.
template <class F>
static bool find(AvatarGlesLoad load, const char* name, F& into, Errors& errors) {
    into = reinterpret_cast<F>(load(name));
    if (into == nullptr) {
        errors.set("OpenGL", "has no function %s: a context of OpenGL ES 3.1 or OpenGL 4.3, or later, must be current", name);
    }
    return into != nullptr;
}

static bool has_extension(const Gl& gl, Text name) {
    int32_t count = 0;
    gl.GetIntegerv(gl_num_extensions, &count);
    for (int32_t i = 0; i < count; i++) {
        const uint8_t* found = gl.GetStringi(gl_extensions, static_cast<uint32_t>(i));
        if (found != nullptr && name == Text(reinterpret_cast<const char*>(found))) return true;
    }
    return false;
}

static bool check_version(Gl& gl, Errors& errors) {
    const uint8_t* version = gl.GetString(gl_version);
    if (version == nullptr) {
        errors.set("OpenGL", "no context is current");
        return false;
    }
    gl.is_es = std::strncmp(reinterpret_cast<const char*>(version), "OpenGL ES", 9) == 0;
    gl.language = gl.is_es ? AVATAR_GLSL310ES : AVATAR_GLSL430;
    int32_t major = 0, minor = 0;
    gl.GetIntegerv(gl_major_version, &major);
    gl.GetIntegerv(gl_minor_version, &minor);
    const int32_t need = gl.is_es ? 31 : 43;
    if (10 * major + minor >= need) return true;
    errors.set("OpenGL", "this context is OpenGL%s %d.%d; compute shaders need %d.%d", gl.is_es ? " ES" : "", major, minor,
               need / 10, need % 10);
    return false;
}

bool Gl::load(AvatarGlesLoad function, Errors& errors) {
    if (function == nullptr) {
        errors.set("load", "is NULL: give the function that finds those of OpenGL, such as eglGetProcAddress");
        return false;
    }
#define AVATAR_GL_FIND(result, name, parameters) \
    if (!find(function, "gl" #name, name, errors)) return false;
    AVATAR_GL_FUNCTIONS(AVATAR_GL_FIND)
#undef AVATAR_GL_FIND
    if (!check_version(*this, errors)) return false;
    const bool full = !is_es || has_extension(*this, "GL_EXT_color_buffer_float");
    can_blend[AVATAR_GLES_RGBA32F] = !is_es || (full && has_extension(*this, "GL_EXT_float_blend"));
    can_blend[AVATAR_GLES_RGBA16F] = full || has_extension(*this, "GL_EXT_color_buffer_half_float");
    can_blend[AVATAR_GLES_RGBA8] = true;
    GetInteger64v(gl_max_storage_block_size, &most_bytes);
    int32_t side = 0, dims[2] = {0, 0};
    GetIntegerv(gl_max_texture_size, &side);
    GetIntegerv(gl_max_viewport_dims, dims);
    most_width = side < dims[0] ? side : dims[0];
    most_height = side < dims[1] ? side : dims[1];
    clear_errors();
    return true;
}

static void AVATAR_GL_CALL free_nothing(int32_t, const uint32_t*) {}

static void AVATAR_GL_CALL free_no_program(uint32_t) {}

void Gl::forget() {
    DeleteProgram = free_no_program;
    DeleteBuffers = DeleteVertexArrays = DeleteTextures = DeleteSamplers = DeleteFramebuffers = free_nothing;
}

void Gl::clear_errors() const {
    for (int i = 0; i < 16 && GetError() != 0; i++) {  // a lost context has errors without end
    }
}

}  // namespace avatar
