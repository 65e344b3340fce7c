#pragma once
#include <cstddef>
#include <cstdint>

#include "../src/formats/text.h"
#include "avatar_gles.h"

#if defined(_WIN32)
#define AVATAR_GL_CALL __stdcall
#else
#define AVATAR_GL_CALL
#endif

namespace avatar {

/// Functions of OpenGL ES 3.1 that OpenGL 4.3 has, too: result, name, parameters.
#define AVATAR_GL_FUNCTIONS(X)                                                                                      \
    X(const uint8_t*, GetString, (uint32_t))                                                                        \
    X(const uint8_t*, GetStringi, (uint32_t, uint32_t))                                                             \
    X(void, GetIntegerv, (uint32_t, int32_t*))                                                                      \
    X(void, GetInteger64v, (uint32_t, int64_t*))                                                                    \
    X(uint32_t, GetError, ())                                                                                       \
    X(void, Finish, ())                                                                                             \
    X(uint32_t, CreateShader, (uint32_t))                                                                           \
    X(void, ShaderSource, (uint32_t, int32_t, const char* const*, const int32_t*))                                  \
    X(void, CompileShader, (uint32_t))                                                                              \
    X(void, GetShaderiv, (uint32_t, uint32_t, int32_t*))                                                            \
    X(void, GetShaderInfoLog, (uint32_t, int32_t, int32_t*, char*))                                                 \
    X(void, DeleteShader, (uint32_t))                                                                               \
    X(uint32_t, CreateProgram, ())                                                                                  \
    X(void, AttachShader, (uint32_t, uint32_t))                                                                     \
    X(void, LinkProgram, (uint32_t))                                                                                \
    X(void, GetProgramiv, (uint32_t, uint32_t, int32_t*))                                                           \
    X(void, GetProgramInfoLog, (uint32_t, int32_t, int32_t*, char*))                                                \
    X(void, DeleteProgram, (uint32_t))                                                                              \
    X(void, UseProgram, (uint32_t))                                                                                 \
    X(void, GenBuffers, (int32_t, uint32_t*))                                                                       \
    X(void, DeleteBuffers, (int32_t, const uint32_t*))                                                              \
    X(void, BindBuffer, (uint32_t, uint32_t))                                                                       \
    X(void, BindBufferBase, (uint32_t, uint32_t, uint32_t))                                                         \
    X(void, BindBufferRange, (uint32_t, uint32_t, uint32_t, ptrdiff_t, ptrdiff_t))                                  \
    X(void, BufferData, (uint32_t, ptrdiff_t, const void*, uint32_t))                                               \
    X(void, BufferSubData, (uint32_t, ptrdiff_t, ptrdiff_t, const void*))                                           \
    X(void*, MapBufferRange, (uint32_t, ptrdiff_t, ptrdiff_t, uint32_t))                                            \
    X(uint8_t, UnmapBuffer, (uint32_t))                                                                             \
    X(void, DispatchCompute, (uint32_t, uint32_t, uint32_t))                                                        \
    X(void, MemoryBarrier, (uint32_t))                                                                              \
    X(void, GenVertexArrays, (int32_t, uint32_t*))                                                                  \
    X(void, DeleteVertexArrays, (int32_t, const uint32_t*))                                                         \
    X(void, BindVertexArray, (uint32_t))                                                                            \
    X(void, EnableVertexAttribArray, (uint32_t))                                                                    \
    X(void, VertexAttribPointer, (uint32_t, int32_t, uint32_t, uint8_t, int32_t, const void*))                      \
    X(void, VertexAttribDivisor, (uint32_t, uint32_t))                                                              \
    X(void, DrawArrays, (uint32_t, int32_t, int32_t))                                                               \
    X(void, DrawArraysInstanced, (uint32_t, int32_t, int32_t, int32_t))                                             \
    X(void, GenTextures, (int32_t, uint32_t*))                                                                      \
    X(void, DeleteTextures, (int32_t, const uint32_t*))                                                             \
    X(void, BindTexture, (uint32_t, uint32_t))                                                                      \
    X(void, ActiveTexture, (uint32_t))                                                                              \
    X(void, TexStorage2D, (uint32_t, int32_t, uint32_t, int32_t, int32_t))                                          \
    X(void, TexParameteri, (uint32_t, uint32_t, int32_t))                                                           \
    X(void, GetTexLevelParameteriv, (uint32_t, int32_t, uint32_t, int32_t*))                                        \
    X(void, GenSamplers, (int32_t, uint32_t*))                                                                      \
    X(void, DeleteSamplers, (int32_t, const uint32_t*))                                                             \
    X(void, BindSampler, (uint32_t, uint32_t))                                                                      \
    X(void, SamplerParameteri, (uint32_t, uint32_t, int32_t))                                                       \
    X(void, GenFramebuffers, (int32_t, uint32_t*))                                                                  \
    X(void, DeleteFramebuffers, (int32_t, const uint32_t*))                                                         \
    X(void, BindFramebuffer, (uint32_t, uint32_t))                                                                  \
    X(void, FramebufferTexture2D, (uint32_t, uint32_t, uint32_t, uint32_t, int32_t))                                \
    X(uint32_t, CheckFramebufferStatus, (uint32_t))                                                                 \
    X(void, Viewport, (int32_t, int32_t, int32_t, int32_t))                                                         \
    X(void, ClearBufferfv, (uint32_t, int32_t, const float*))                                                       \
    X(void, Enable, (uint32_t))                                                                                     \
    X(void, Disable, (uint32_t))                                                                                    \
    X(void, BlendEquation, (uint32_t))                                                                              \
    X(void, BlendFunc, (uint32_t, uint32_t))                                                                        \
    X(void, DepthFunc, (uint32_t))                                                                                  \
    X(void, DepthMask, (uint8_t))                                                                                   \
    X(void, ColorMask, (uint8_t, uint8_t, uint8_t, uint8_t))                                                        \
    X(void, PixelStorei, (uint32_t, int32_t))                                                                       \
    X(void, ReadPixels, (int32_t, int32_t, int32_t, int32_t, uint32_t, uint32_t, void*))

/// Numbers of the OpenGL registry.
enum : uint32_t {
    gl_version = 0x1F02,
    gl_renderer = 0x1F01,
    gl_extensions = 0x1F03,
    gl_num_extensions = 0x821D,
    gl_major_version = 0x821B,
    gl_minor_version = 0x821C,
    gl_max_storage_block_size = 0x90DE,
    gl_max_texture_size = 0x0D33,
    gl_max_viewport_dims = 0x0D3A,
    gl_out_of_memory = 0x0505,
    gl_compute_shader = 0x91B9,
    gl_vertex_shader = 0x8B31,
    gl_fragment_shader = 0x8B30,
    gl_compile_status = 0x8B81,
    gl_link_status = 0x8B82,
    gl_storage_buffer = 0x90D2,
    gl_uniform_buffer = 0x8A11,
    gl_array_buffer = 0x8892,
    gl_copy_write_buffer = 0x8F37,
    gl_static_draw = 0x88E4,
    gl_dynamic_draw = 0x88E8,
    gl_map_read = 1,
    gl_map_write = 2,
    gl_map_invalidate_buffer = 8,
    gl_vertex_attribute_barrier = 0x1,
    gl_storage_barrier = 0x2000,
    gl_buffer_update_barrier = 0x200,
    gl_float = 0x1406,
    gl_unsigned_byte = 0x1401,
    gl_triangles = 4,
    gl_triangle_strip = 5,
    gl_texture_2d = 0x0DE1,
    gl_texture0 = 0x84C0,
    gl_texture_min_filter = 0x2801,
    gl_texture_mag_filter = 0x2800,
    gl_nearest = 0x2600,
    gl_texture_width = 0x1000,
    gl_texture_height = 0x1001,
    gl_texture_depth_size = 0x884A,
    gl_rgba = 0x1908,
    gl_rgba32f = 0x8814,
    gl_rgba16f = 0x881A,
    gl_rgba8 = 0x8058,
    gl_depth_component32f = 0x8CAC,
    gl_framebuffer = 0x8D40,
    gl_framebuffer_complete = 0x8CD5,
    gl_colour_attachment0 = 0x8CE0,
    gl_depth_attachment = 0x8D00,
    gl_colour = 0x1800,
    gl_blend = 0x0BE2,
    gl_depth_test = 0x0B71,
    gl_cull_face = 0x0B44,
    gl_scissor_test = 0x0C11,
    gl_stencil_test = 0x0B90,
    gl_dither = 0x0BD0,
    gl_function_add = 0x8006,
    gl_one = 1,
    gl_one_minus_source_alpha = 0x0303,
    gl_less_or_equal = 0x0203,
    gl_greater_or_equal = 0x0206,
    gl_always = 0x0207,
    gl_pack_alignment = 0x0D05,
};

/// The functions of a context, and what it can do.
struct Gl {
#define AVATAR_GL_MEMBER(result, name, parameters) result(AVATAR_GL_CALL* name) parameters;
    AVATAR_GL_FUNCTIONS(AVATAR_GL_MEMBER)
#undef AVATAR_GL_MEMBER

    bool is_es;
    bool can_blend[3];  // by AVATAR_GLES_RGBA32F ..
    uint32_t language;  // of shader texts
    int64_t most_bytes; // of a storage buffer
    int32_t most_width, most_height; // pixels of an image

    /// Finds the functions of the current context and asks what it can do. Sets the error for one that is too old.
    bool load(AvatarGlesLoad function, Errors& errors);

    /// The context is gone: what frees objects does nothing until the next `load`.
    void forget();

    /// Forgets errors of GL that nobody has asked for.
    void clear_errors() const;
};

}  // namespace avatar
