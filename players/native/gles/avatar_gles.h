/* Plays avatars on OpenGL ES 3.1 or OpenGL 4.3, or later, in the caller's context. C99 and C++. play/avatar_play.cpp is
 * a whole program. No GL library is linked: functions come from the loader that the caller gives.
 *
 * An AvatarGles is a scene: the avatars that are added to it are sorted and drawn together. It belongs to one thread and
 * to the context that was current when it was opened (or to one that shares its objects, except where vertex arrays and
 * framebuffers are drawn with: those are not shared). That context must be current in every call.
 *
 * Errors, arguments and structs are as in avatar_player.h: AVATAR_FAILED, and one line in the handle.
 *
 * Memory. Frames allocate nothing, but for the first one after an instance was added, removed, shown, hidden, set to
 * another level or first lit, and for an image of another size. Everything is freed by avatar_gles_close.
 *
 * GL state. Nothing is saved and nothing is restored. These calls leave changed:
 *   - the program in use; the vertex array (0 afterwards); GL_ARRAY_BUFFER, GL_SHADER_STORAGE_BUFFER and
 *     GL_UNIFORM_BUFFER; storage buffers 0 to 3 and uniform buffer 8 (indexed); GL_COPY_WRITE_BUFFER
 *   - the active texture unit (0), GL_TEXTURE_2D and the sampler (0 afterwards) of unit 0
 *   - the draw and read framebuffer, the viewport, the colour mask (all true), the depth mask (true)
 *   - GL_BLEND, blend function and equation, GL_DEPTH_TEST, depth function
 *   - GL_CULL_FACE, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_DITHER: disabled
 *   - GL_PACK_ALIGNMENT (4) by avatar_gles_read; errors of GL that nobody has asked for
 * These must be as in a new context: clip control, depth range, polygon mode, logic operation, GL_RASTERIZER_DISCARD,
 * alpha to coverage, sample mask, GL_SAMPLE_SHADING, pack buffers and pack parameters, transform feedback. */
#ifndef AVATAR_GLES_H
#define AVATAR_GLES_H

#include "avatar_conform.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct AvatarGles AvatarGles;

/* The address of a GL function, or NULL: eglGetProcAddress, or the same of another window system. */
typedef void (*AvatarGlesFunction)(void);
typedef AvatarGlesFunction (*AvatarGlesLoad)(const char* name);

/* An empty scene in the current context. NULL as avatar_load. */
AVATAR_API AvatarGles* avatar_gles_open(AvatarGlesLoad load, const AvatarAllocator* allocator);
/* Frees all that it made in the context, which must be current. NULL is taken. Packs and instances stay. */
AVATAR_API void avatar_gles_close(AvatarGles* gles);
/* The line of the newest call; NULL: it did not fail. A NULL handle has a line. */
AVATAR_API const char* avatar_gles_error(const AvatarGles* gles);
/* What the driver calls its renderer. */
AVATAR_API const char* avatar_gles_renderer(const AvatarGles* gles);

/* ---- The image into which splats are blended ---------------------------------------------------------------------- */

/* RGBA32F is the exact one; RGBA16F and RGBA8 round at every splat. */
enum { AVATAR_GLES_RGBA32F = 0, AVATAR_GLES_RGBA16F = 1, AVATAR_GLES_RGBA8 = 2 };
/* 1: this context can blend into such an image. OpenGL ES needs EXT_color_buffer_float and EXT_float_blend for RGBA32F,
 * EXT_color_buffer_float or EXT_color_buffer_half_float for RGBA16F. */
AVATAR_API int avatar_gles_can_blend(const AvatarGles* gles, uint32_t target);
/* A new scene has the most exact image that its context can blend. Fails for one that it cannot. */
AVATAR_API int avatar_gles_set_target(AvatarGles* gles, uint32_t target);
AVATAR_API uint32_t avatar_gles_target(const AvatarGles* gles);

/* ---- Avatars ------------------------------------------------------------------------------------------------------ */

/* Uploads an instance of the pack at its level, and the pack where no other instance has. It is shown. Both must live
 * until it is removed or the scene is closed. Fails where a buffer exceeds a limit of the device. */
AVATAR_API int avatar_gles_add(AvatarGles* gles, const AvatarPack* pack, AvatarInstance* instance);
/* Frees what it held; a pack's buffers with its last instance. */
AVATAR_API int avatar_gles_remove(AvatarGles* gles, const AvatarInstance* instance);
/* Shows or hides it; what it holds stays. */
AVATAR_API int avatar_gles_show(AvatarGles* gles, const AvatarInstance* instance, int shown);

/* ---- A frame ------------------------------------------------------------------------------------------------------ */

/* Once a pose: takes the poses of the instances that are shown (avatar_update_pose) and deforms those that changed. A
 * level that was set is uploaded. */
AVATAR_API int avatar_gles_pose(AvatarGles* gles);

/* The depth of what is drawn already. A splat whose mean lies behind it is hidden at that pixel. */
typedef struct AvatarGlesDepth {
    uint32_t struct_size AVATAR_SIZE(AvatarGlesDepth);
    uint32_t texture; /* GL_TEXTURE_2D of a depth format, one sample, of the camera's size, its first row at the bottom.
                         Another texture is refused */
    int reversed;     /* 1: larger is nearer */
} AvatarGlesDepth;

/* Once a camera, for each eye: projects, sorts and draws into the image. The camera's depth, z / w of clip_from_world,
 * must be that of the depth texture: avatar_gles_camera_depth. `depth` NULL: nothing hides splats. */
AVATAR_API int avatar_gles_draw(AvatarGles* gles, const AvatarCamera* camera, const AvatarGlesDepth* depth);
/* Gives a camera of avatar_camera_opengl the depth of the same view and projection [4, 4], so that splats and the
 * engine's own triangles compare. Returns NULL, or a line that belongs to the library; then the camera stays as it is. */
AVATAR_API const char* avatar_gles_camera_depth(AvatarCamera* camera, const double* view, const double* projection);

/* Puts the image onto a framebuffer, from its lower left corner on. 0: the default framebuffer. `background` [3] is
 * display-referred and replaces what is there; NULL: the image is put over what is there (premultiplied alpha).
 * `linear` 1: the framebuffer holds linear light, or is sRGB and encodes it. */
AVATAR_API int avatar_gles_composite(AvatarGles* gles, uint32_t framebuffer, const float* background, int linear);
/* Reads the image: premultiplied colour and alpha [height, width, 4], first row on top. Waits for the GPU. */
AVATAR_API int avatar_gles_read(AvatarGles* gles, float* rgba);

/* ---- More ---------------------------------------------------------------------------------------------------------- */

/* A lost context. `forget` drops the names of all objects without calling GL: the context is gone. Afterwards close the
 * scene, or make another context current, of the same kind, and `restore`: everything is uploaded again. */
AVATAR_API void avatar_gles_forget(AvatarGles* gles);
AVATAR_API int avatar_gles_restore(AvatarGles* gles);

/* For measuring: after each stage of a frame the scene waits for the GPU and calls `ended` with the stage's name. NULL:
 * no more. Stages are "joints", those of AvatarDispatch, "raster" and "composite". */
AVATAR_API void avatar_gles_set_clock(AvatarGles* gles, void (*ended)(void* user, const char* stage), void* user);

/* Fills in what avatar_conform calls. It lives as long as the scene and holds buffers of its own. Conformance is stated
 * for RGBA32F. */
AVATAR_API int avatar_gles_stage_runner(AvatarGles* gles, AvatarStageRunner* out);

#ifdef __cplusplus
}
#endif

#endif
