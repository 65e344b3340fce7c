#include "programs.h"

namespace avatar {

/// The first line of what a compiler says.
static void cut_to_line(char* log) {
    for (char* at = log; *at != 0; at++) {
        if (*at == '\n' || *at == '\r') *at = 0;
        if (*at == 0) return;
    }
}

uint32_t Programs::kernel(Errors& errors, const char* entry) {
    for (uint32_t i = 0; i < count_; i++) {
        if (std::strcmp(known_[i].entry, entry) == 0) return known_[i].program;
    }
    const char* text = avatar_shader(gl_.language, entry);
    if (text == nullptr || count_ == most) {
        errors.set(entry, "is no shader of this library");
        return 0;
    }
    const uint32_t shader = compiled(errors, entry, gl_compute_shader, text);
    const uint32_t made = shader == 0 ? 0 : linked(errors, entry, &shader, 1);
    if (made != 0) known_[count_++] = {entry, made};
    return made;
}

uint32_t Programs::drawing(Errors& errors, const char* what, const char* vertex, const char* pixel) {
    const uint32_t first = compiled(errors, what, gl_vertex_shader, vertex);
    const uint32_t second = first == 0 ? 0 : compiled(errors, what, gl_fragment_shader, pixel);
    const uint32_t shaders[] = {first, second};
    if (second != 0) return linked(errors, what, shaders, 2);
    if (first != 0) gl_.DeleteShader(first);
    return 0;
}

void Programs::release() {
    for (uint32_t i = 0; i < count_; i++) gl_.DeleteProgram(known_[i].program);
    count_ = 0;
}

uint32_t Programs::compiled(Errors& errors, const char* what, uint32_t kind, const char* text) {
    const uint32_t shader = gl_.CreateShader(kind);
    gl_.ShaderSource(shader, 1, &text, nullptr);
    gl_.CompileShader(shader);
    int32_t good = 0;
    gl_.GetShaderiv(shader, gl_compile_status, &good);
    if (good != 0) return shader;
    char log[400] = "";
    gl_.GetShaderInfoLog(shader, sizeof log, nullptr, log);
    cut_to_line(log);
    errors.set(what, "the driver does not compile this shader: %s", log);
    gl_.DeleteShader(shader);
    return 0;
}

/// Frees the shaders, too.
uint32_t Programs::linked(Errors& errors, const char* what, const uint32_t* shaders, uint32_t count) {
    const uint32_t program = gl_.CreateProgram();
    for (uint32_t i = 0; i < count; i++) {
        gl_.AttachShader(program, shaders[i]);
        gl_.DeleteShader(shaders[i]);
    }
    gl_.LinkProgram(program);
    int32_t good = 0;
    gl_.GetProgramiv(program, gl_link_status, &good);
    if (good != 0) return program;
    char log[400] = "";
    gl_.GetProgramInfoLog(program, sizeof log, nullptr, log);
    cut_to_line(log);
    errors.set(what, "the driver does not link this shader: %s", log);
    gl_.DeleteProgram(program);
    return 0;
}

}  // namespace avatar
