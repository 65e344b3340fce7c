/* Plays avatars on Direct3D 11, on a device of feature level 11_0 or later of the caller's. C99 and C++. No wave operations
 * and no library of Direct3D are needed at link time: all calls go through the caller's device.
 *
 * An AvatarD3d11 is a scene: the avatars that are added to it are sorted and drawn together. It belongs to one thread at a
 * time, the one that may use the device's immediate context.
 *
 * Kernels are compiled by Microsoft's d3dcompiler_47.dll, once a scene; what was compiled outlives a lost device. Windows
 * 8.1 and later have the DLL, and a program may have it beside itself. Without it a scene fails to open, and it refuses
 * the compiler that Wine has under the same name.
 *
 * Errors, arguments and structs are as in avatar_player.h: AVATAR_FAILED, and one line in the handle.
 *
 * Memory. Frames allocate nothing, but for the first one after an instance was added, removed, shown, hidden, set to
 * another level or first lit, and for an image of another size. Everything is freed by avatar_d3d11_close.
 *
 * Direct3D state of the immediate context. Nothing is saved and nothing is restored. These calls leave changed:
 *   - the shaders of all stages (hull, domain and geometry: none)
 *   - constant buffer 0 of the compute, vertex and pixel stage; shader resources 0 to 7 of the compute stage and 0 of the
 *     vertex and pixel stage (none afterwards); unordered access views 0 to 7 of the compute stage (none afterwards)
 *   - the input layout (none), the topology, the viewports (one)
 *   - the rasterizer, depth-stencil and blend state, the blend factor and sample mask; the render targets (none afterwards)
 * These must be as in a new context: predication and stream output. The avatars' resources must not be those of a deferred
 * context that is executed later. */
#ifndef AVATAR_D3D11_H
#define AVATAR_D3D11_H

#include "avatar_conform.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct AvatarD3d11 AvatarD3d11;

/* Of d3d11.h. */
typedef struct ID3D11Device ID3D11Device;
typedef struct ID3D11DepthStencilView ID3D11DepthStencilView;
typedef struct ID3D11RenderTargetView ID3D11RenderTargetView;

/* An empty scene on a device, which it keeps a reference to. NULL as avatar_load. */
AVATAR_API AvatarD3d11* avatar_d3d11_open(ID3D11Device* device, const AvatarAllocator* allocator);
/* Frees all that it made on the device. NULL is taken. Packs and instances stay. */
AVATAR_API void avatar_d3d11_close(AvatarD3d11* d3d11);
/* The line of the newest call; NULL: it did not fail. A NULL handle has a line. */
AVATAR_API const char* avatar_d3d11_error(const AvatarD3d11* d3d11);
/* What the driver calls its adapter. */
AVATAR_API const char* avatar_d3d11_renderer(const AvatarD3d11* d3d11);
/* The file of the compiler that compiles the kernels. */
AVATAR_API const char* avatar_d3d11_compiler(const AvatarD3d11* d3d11);

/* ---- The image into which splats are blended ---------------------------------------------------------------------- */

/* RGBA32F is the exact one; RGBA16F and RGBA8 round at every splat. */
enum { AVATAR_D3D11_RGBA32F = 0, AVATAR_D3D11_RGBA16F = 1, AVATAR_D3D11_RGBA8 = 2 };
/* 1: this device can blend into such an image. */
AVATAR_API int avatar_d3d11_can_blend(const AvatarD3d11* d3d11, uint32_t target);
/* A new scene has the most exact image that its device can blend. Fails for one that it cannot. */
AVATAR_API int avatar_d3d11_set_target(AvatarD3d11* d3d11, uint32_t target);
AVATAR_API uint32_t avatar_d3d11_target(const AvatarD3d11* d3d11);

/* ---- Avatars ------------------------------------------------------------------------------------------------------ */

/* Uploads an instance of the pack at its level, and the pack where no other instance has. It is shown. Both must live
 * until it is removed or the scene is closed. Fails where a buffer exceeds a limit of the device. */
AVATAR_API int avatar_d3d11_add(AvatarD3d11* d3d11, const AvatarPack* pack, AvatarInstance* instance);
/* Frees what it held; a pack's buffers with its last instance. */
AVATAR_API int avatar_d3d11_remove(AvatarD3d11* d3d11, const AvatarInstance* instance);
/* Shows or hides it; what it holds stays. */
AVATAR_API int avatar_d3d11_show(AvatarD3d11* d3d11, const AvatarInstance* instance, int shown);

/* ---- A frame ------------------------------------------------------------------------------------------------------ */

/* Once a pose: takes the poses of the instances that are shown (avatar_update_pose) and deforms those that changed. A
 * level that was set is uploaded. */
AVATAR_API int avatar_d3d11_pose(AvatarD3d11* d3d11);

/* The depth of what is drawn already. A splat whose mean lies behind it is hidden at that pixel. It is tested and not
 * written. */
typedef struct AvatarD3d11Depth {
    uint32_t struct_size AVATAR_SIZE(AvatarD3d11Depth);
    int reversed;                 /* 1: larger is nearer */
    ID3D11DepthStencilView* view; /* of one 2D texture of the camera's size, one sample a pixel. Another one is refused, such
                                     as that of a multisampled target: give a resolved depth */
} AvatarD3d11Depth;

/* Once a camera, for each eye: projects, sorts and draws into the image. The camera's depth, z / w of clip_from_world,
 * must be that of the depth view: avatar_d3d11_camera_depth. `depth` NULL: nothing hides splats. */
AVATAR_API int avatar_d3d11_draw(AvatarD3d11* d3d11, const AvatarCamera* camera, const AvatarD3d11Depth* depth);
/* Gives a camera the depth of the same view and projection [4, 4], of columns, with depths of 0 to 1 as Direct3D has them,
 * so that splats and the engine's own triangles compare. Returns NULL, or a line that belongs to the library; then the
 * camera stays as it is. */
AVATAR_API const char* avatar_d3d11_camera_depth(AvatarCamera* camera, const double* view, const double* projection);

/* Puts the image onto a render target, from its upper left corner on; a multisampled one gets it in all samples.
 * `background` [3] is display-referred and replaces what is there; NULL: the image is put over what is there (premultiplied
 * alpha). `linear` 1: the target holds linear light, or is sRGB and encodes it. */
AVATAR_API int avatar_d3d11_composite(AvatarD3d11* d3d11, ID3D11RenderTargetView* target, const float* background, int linear);
/* Reads the image: premultiplied colour and alpha [height, width, 4], first row on top. Waits for the GPU. */
AVATAR_API int avatar_d3d11_read(AvatarD3d11* d3d11, float* rgba);

/* ---- More ---------------------------------------------------------------------------------------------------------- */

/* A device that was removed. `forget` releases everything on it. Afterwards close the scene, or `restore` it on a new
 * device: everything is uploaded again. */
AVATAR_API void avatar_d3d11_forget(AvatarD3d11* d3d11);
AVATAR_API int avatar_d3d11_restore(AvatarD3d11* d3d11, ID3D11Device* device);

/* For measuring: after each stage of a frame the scene waits for the GPU and calls `ended` with the stage's name. NULL:
 * no more. Stages are "joints", those of AvatarDispatch, "raster" and "composite". */
AVATAR_API void avatar_d3d11_set_clock(AvatarD3d11* d3d11, void (*ended)(void* user, const char* stage), void* user);

/* Fills in what avatar_conform calls. It lives as long as the scene and holds buffers of its own. Conformance is stated
 * for RGBA32F. */
AVATAR_API int avatar_d3d11_stage_runner(AvatarD3d11* d3d11, AvatarStageRunner* out);

#ifdef __cplusplus
}
#endif

#endif
