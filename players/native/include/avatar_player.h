/* Plays packs of Gaussian avatars (NAME.avatar): loading, posing, lists of passes for an engine. README.md shows how.
 *
 * Threads. A loaded AvatarPack never changes: any number of threads may read it at once. Every other handle belongs to
 * one thread at a time. Two handles never share what they write, so two threads may use two of them at once.
 * Functions that take an AvatarPack as const, and nothing else but values, may be called by several threads at once.
 *
 * Errors. A function that can fail returns AVATAR_OK or AVATAR_FAILED; the handle then holds one line that says whose
 * file, which field, what is wrong and what to do. A handle whose making failed is returned, too, with the line; it
 * must be closed as any other, and every function refuses it. All texts are UTF-8, end with a zero, and belong to
 * their handle: they live until it is closed, lines of errors until its next error.
 *
 * Arguments. A NULL where a handle, a camera, a text or a place for a result is needed, an index beyond the last and a
 * name that is not there are refused: AVATAR_FAILED, NULL, 0 or -1, and a line where the handle can hold one (an AvatarPack
 * cannot). So are numbers that are not finite: none of them reaches a GPU. A time that is NaN is the first frame.
 *
 * Structs. Each struct begins with struct_size, which the caller sets to the size that it was compiled with:
 *   AvatarFacts facts = {.struct_size = sizeof facts};       in C++ it is set already: AvatarFacts facts;
 * A later version may add fields at the end of a struct. The library reads and writes nothing beyond struct_size. Fields
 * that the caller does not have are 0 to the library; fields that the library does not know it sets to 0. A struct_size
 * of 0, or of more than 4096, is refused as a NULL is. The elements of an array have one struct_size: the library goes
 * from one to the next by it. The library gives no arrays of structs away: they are asked for by index.
 *
 * Versions. Before 1.0, functions may change from one minor version to the next. A program that does not bring its own
 * library refuses one whose avatar_player_version() / 1000 differs from AVATAR_PLAYER_VERSION / 1000.
 *
 * Memory. All memory comes from the allocator that a handle was opened with. Where it gives none, the handle fails
 * with a line. Functions that say "allocates nothing" do not call it.
 *
 * Matrices are row-major for column vectors. Metres, radians. There are two frames, both with +Y up and the face along
 * +Z. The person's is right-handed for every pack, +X is the person's left: places, boxes, what a camera may look at, and
 * the turns of avatar_set_joint are in it. Arrays of a pack or a pose are in the pack's own: right-handed, or left-handed
 * (+X is the person's right) as avatar_facts says. So a host treats both kinds alike, and both show the same. */
#ifndef AVATAR_PLAYER_H
#define AVATAR_PLAYER_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef AVATAR_API
#define AVATAR_API /* an engine that builds a library of its own may set its export attribute */
#endif

#ifdef __cplusplus /* struct_size is set */
#define AVATAR_SIZE(type) = sizeof(type)
#else
#define AVATAR_SIZE(type)
#endif

#define AVATAR_PLAYER_VERSION_MAJOR 0
#define AVATAR_PLAYER_VERSION_MINOR 1
#define AVATAR_PLAYER_VERSION_PATCH 0
#define AVATAR_PLAYER_VERSION \
    (AVATAR_PLAYER_VERSION_MAJOR * 1000000 + AVATAR_PLAYER_VERSION_MINOR * 1000 + AVATAR_PLAYER_VERSION_PATCH)
/* AVATAR_PLAYER_VERSION of the header with which the library was compiled. Any thread. */
AVATAR_API uint32_t avatar_player_version(void);

enum { AVATAR_FAILED = 0, AVATAR_OK = 1 };
enum { AVATAR_ARKIT_WEIGHTS = 52, AVATAR_ARKIT_CHANNELS = 61 };
enum { AVATAR_BLOCK_ALIGN = 256 }; /* bytes: where the uniform block of each dispatch begins */

/* Gives and takes memory. `allocate` returns memory for any type, or NULL; `release` gets what it gave, with the same
 * size. Both are called by the threads that use the handles. */
typedef struct AvatarAllocator {
    uint32_t struct_size AVATAR_SIZE(AvatarAllocator);
    void* (*allocate)(void* user, size_t bytes);
    void (*release)(void* user, void* memory, size_t bytes);
    void* user;
} AvatarAllocator;

typedef struct AvatarPack AvatarPack;           /* a loaded, checked pack */
typedef struct AvatarInstance AvatarInstance;   /* one avatar in a scene: its pose, its place */
typedef struct AvatarPasses AvatarPasses;       /* dispatches with their constants */
typedef struct AvatarSort AvatarSort;           /* the sort of all splats of a scene */
typedef struct AvatarRecording AvatarRecording; /* a recording of a face */

/* ---- Packs ------------------------------------------------------------------------------------------------------- */

/* Loads and checks the bytes of a pack. `name` is what errors call it. The bytes are not needed afterwards; nor is
 * `name`. `allocator` may be NULL: malloc. Its functions and `user` must live as long as the handle. Returns NULL only where
 * the allocator cannot be used, or does not even have memory for the handle. */
AVATAR_API AvatarPack* avatar_load(const void* file, size_t bytes, const char* name, const AvatarAllocator* allocator);
/* Instances, passes and reports of a pack must be closed before it. NULL is taken. */
AVATAR_API void avatar_close(AvatarPack* pack);
/* NULL for a sound pack; else the line. A NULL handle has a line, too. */
AVATAR_API const char* avatar_error(const AvatarPack* pack);
/* What a person may want to know. A text or pointer is NULL where the pack does not say. */
typedef struct AvatarFacts {
    uint32_t struct_size AVATAR_SIZE(AvatarFacts);
    const char* name;
    const char* license;   /* what it may be used for */
    const char* consent;   /* what the person agreed to */
    int left_handed;       /* 1: its arrays, and those of its poses, are in a left-handed frame */
    uint32_t expressions;  /* K */
    uint32_t eyelids;      /* L */
    uint32_t joints;       /* J; 0 without a rig */
    uint32_t groups;       /* G */
    uint32_t clips;
    uint32_t levels;       /* of detail, 0 the finest */
    uint32_t buffers;
    uint32_t anchors;      /* A, anchor vertices */
    int drivable;          /* 1: ARKit can drive it */
    const double* bounds_low;  /* [3], over all poses */
    const double* bounds_high; /* [3] */
    const double* background;  /* [3] of training, as displayed; NULL: random */
    const double* up;          /* [3] */
    const double* front;       /* [3] the direction in which the avatar looks */
    const double* whole_target; /* [3] the middle of the avatar at rest */
    const double* whole_size;   /* [3] width, height, depth */
    const double* head_target;  /* [3] */
    const double* head_size;    /* [3] */
    const uint8_t* preview;     /* a picture, WebP */
    size_t preview_bytes;
    size_t file_bytes;
    int relit; /* 1: it takes the light of a scene: avatar_light.h */
} AvatarFacts;
AVATAR_API int avatar_facts(const AvatarPack* pack, AvatarFacts* out);
/* Names by index; NULL beyond the last. */
AVATAR_API const char* avatar_expression_name(const AvatarPack* pack, uint32_t index);
AVATAR_API const char* avatar_eyelid_name(const AvatarPack* pack, uint32_t index);
AVATAR_API const char* avatar_joint_name(const AvatarPack* pack, uint32_t index);
/* Other names of an expression, by index; NULL beyond the last. */
AVATAR_API const char* avatar_expression_alias(const AvatarPack* pack, uint32_t expression, uint32_t index);
/* Indices by name (of expressions, also by another name of theirs); -1: there is none. */
AVATAR_API int32_t avatar_expression_index(const AvatarPack* pack, const char* name);
AVATAR_API int32_t avatar_eyelid_index(const AvatarPack* pack, const char* name);
AVATAR_API int32_t avatar_joint_index(const AvatarPack* pack, const char* name);
/* The trained range of an expression. */
AVATAR_API void avatar_expression_range(const AvatarPack* pack, uint32_t index, double* low, double* high);
/* [J] the parent of each joint, -1 for a root, a parent before its children; NULL without a rig. */
AVATAR_API const int32_t* avatar_joint_parents(const AvatarPack* pack);
/* [J, 4, 4] parent from joint at rest, and joint from mesh; NULL without a rig. */
AVATAR_API const double* avatar_rest_local(const AvatarPack* pack);
AVATAR_API const double* avatar_inverse_bind(const AvatarPack* pack);

typedef struct AvatarGroup {
    uint32_t struct_size AVATAR_SIZE(AvatarGroup);
    const char* name;    /* "face", "lower_teeth" */
    uint32_t first;      /* Gaussian */
    uint32_t count;
    const char* binding; /* "skin", "anchor", "joint_mix", "surface" or "none" */
} AvatarGroup;
AVATAR_API int avatar_group(const AvatarPack* pack, uint32_t index, AvatarGroup* out);

typedef struct AvatarClip {
    uint32_t struct_size AVATAR_SIZE(AvatarClip);
    const char* name;
    double fps;
    double seconds;  /* from the first frame to the last */
    uint32_t frames; /* T */
    const float* expression_weights; /* [T, K] */
    const float* eyelid_weights;     /* [T, L] */
    const float* joint_delta;        /* [T, J, 4, 4] */
    const float* world_from_avatar;  /* [T, 4, 4] */
} AvatarClip;
AVATAR_API int avatar_clip(const AvatarPack* pack, uint32_t index, AvatarClip* out);

typedef struct AvatarLevel {
    uint32_t struct_size AVATAR_SIZE(AvatarLevel);
    uint32_t count;   /* Gaussians */
    uint32_t chunks;
    double height_px; /* avatar_height_px up to which it is meant; below 0: any */
    double psnr_db;   /* of its images against the source, inside the mask; below 0: not measured */
} AvatarLevel;
AVATAR_API int avatar_level(const AvatarPack* pack, uint32_t index, AvatarLevel* out);
/* The coarsest level that serves an avatar so many pixels high; of a NaN the finest. */
AVATAR_API uint32_t avatar_level_for(const AvatarPack* pack, double height_px);
/* The level to show after `level`: it stays where the height is within a tenth of its borders. */
AVATAR_API uint32_t avatar_next_level(const AvatarPack* pack, double height_px, uint32_t level);
/* A chunk of the Gaussians of a level: rows that one dispatch takes. Its splats, as stage project writes them, are in
 * buffer `projected`. */
typedef struct AvatarChunk {
    uint32_t struct_size AVATAR_SIZE(AvatarChunk);
    uint32_t first;
    uint32_t count;
    uint32_t projected; /* index of a buffer */
} AvatarChunk;
AVATAR_API int avatar_chunk(const AvatarPack* pack, uint32_t level, uint32_t chunk, AvatarChunk* out);
/* A storage buffer. One with content is never written by a pass; the others begin with zeros. Buffer "Pose" is
 * written by the host: avatar_pose_floats. */
typedef struct AvatarBuffer {
    uint32_t struct_size AVATAR_SIZE(AvatarBuffer);
    const char* name;
    uint32_t bytes;
    int has_content;
} AvatarBuffer;
AVATAR_API int avatar_buffer(const AvatarPack* pack, uint32_t index, AvatarBuffer* out);
/* -1: there is none. */
AVATAR_API int32_t avatar_buffer_index(const AvatarPack* pack, const char* name);
/* Writes all bytes of a buffer with content into memory, such as mapped memory of a GPU. Allocates nothing. */
AVATAR_API int avatar_buffer_content(const AvatarPack* pack, uint32_t index, void* into);
/* The mesh of the rig: triangles [3, F] (all first corners, then all second ones), where the pack has them. */
AVATAR_API const uint32_t* avatar_triangles(const AvatarPack* pack, uint32_t* count);

/* ---- Instances ---------------------------------------------------------------------------------------------------- */

/* An avatar at rest, played at a level. Several instances may share a pack. NULL as avatar_load, and for a NULL pack. */
AVATAR_API AvatarInstance* avatar_instance_open(const AvatarPack* pack, uint32_t level, const AvatarAllocator* allocator);
AVATAR_API void avatar_instance_close(AvatarInstance* instance);
/* The newest line; NULL: nothing has failed yet. */
AVATAR_API const char* avatar_instance_error(const AvatarInstance* instance);
/* The pose. The arrays may be written directly: avatar_update_pose and avatar_update_camera refuse what is not finite in
 * them. None of these functions allocates. */
AVATAR_API void avatar_reset_pose(AvatarInstance* instance);
AVATAR_API int avatar_set_expression(AvatarInstance* instance, const char* name, double weight);
AVATAR_API int avatar_set_eyelid(AvatarInstance* instance, const char* name, double weight);
/* Turns a joint by a rotation vector (axis times angle, radians) in the joint's rest frame, right-handed for every pack. */
AVATAR_API int avatar_set_joint(AvatarInstance* instance, const char* name, double rx, double ry, double rz);
AVATAR_API float* avatar_expression_weights(AvatarInstance* instance); /* [K] */
AVATAR_API float* avatar_eyelid_weights(AvatarInstance* instance);     /* [L] */
AVATAR_API double* avatar_joint_delta(AvatarInstance* instance); /* [J, 4, 4]: parent_from_joint = rest_local delta */
AVATAR_API double* avatar_world_from_avatar(AvatarInstance* instance); /* [4, 4] rigid, of the pose */
AVATAR_API double* avatar_place(AvatarInstance* instance); /* [4, 4] scene from the person, affine; the pose comes first */
AVATAR_API int avatar_set_level(AvatarInstance* instance, uint32_t level);
AVATAR_API uint32_t avatar_instance_level(const AvatarInstance* instance);
/* Writes the pose of a clip at a time. Times beyond its ends are those of the ends. Allocates nothing. */
AVATAR_API int avatar_clip_pose(AvatarInstance* instance, uint32_t clip, double seconds);
/* A captured frame of a face. Weights are in the order of avatar_arkit_name. Angles are yaw, pitch and roll, radians.
 * left_eye has the channels leftEye* of a recorder: the subject's right eye. */
typedef struct AvatarFrame {
    uint32_t struct_size AVATAR_SIZE(AvatarFrame);
    float weights[AVATAR_ARKIT_WEIGHTS];
    double head[3];
    double left_eye[3];
    double right_eye[3];
} AvatarFrame;
/* ARKit's names [52], then the nine angles: headYaw, headPitch, headRoll, leftEyeYaw, ... NULL beyond. Any thread. */
AVATAR_API const char* avatar_arkit_name(uint32_t channel);
/* The channel that a name spells, as tools spell them ("BS_node.jawOpen", "eyeBlink_L"); -1: none. Any thread. */
AVATAR_API int32_t avatar_arkit_channel(const char* name);
/* Takes the face of a UDP packet of Live Link Face. Returns 0, and leaves the frame as it is, for a packet without a
 * face or one that is not understood to its last byte. Allocates nothing. Any thread. */
AVATAR_API int avatar_read_packet(const void* packet, size_t bytes, AvatarFrame* frame);
/* Lets captured frames drive the instance. `within_range` limits expressions to their trained ranges and eyelids to
 * 0..1. Fails where ARKit cannot drive the avatar, and for a joint that cannot turn. Only the first call of either kind
 * allocates. */
AVATAR_API int avatar_enable_driving(AvatarInstance* instance, int within_range);
/* Writes the pose of a frame; what the frame does not move is at rest. Allocates nothing. */
AVATAR_API int avatar_drive(AvatarInstance* instance, const AvatarFrame* frame);
/* Writes what a person does who only sits there at a time: breathes, blinks, looks about. It depends on time and seed
 * alone. Fails for times that are not finite or beyond 1e15. Allocates nothing. Any thread. */
AVATAR_API int avatar_idle(double seconds, uint32_t seed, AvatarFrame* frame);
/* A recording: the text of a CSV file of Live Link Face. `name` is what errors call it. NULL as avatar_load. */
AVATAR_API AvatarRecording* avatar_recording_open(const char* text, size_t bytes, const char* name,
                                                  const AvatarAllocator* allocator);
AVATAR_API void avatar_recording_close(AvatarRecording* recording);
AVATAR_API const char* avatar_recording_error(const AvatarRecording* recording);
typedef struct AvatarRecordingFacts {
    uint32_t struct_size AVATAR_SIZE(AvatarRecordingFacts);
    uint32_t frames;       /* F */
    uint32_t without_face; /* records that are left out */
    double fps;
    double seconds;
    const double* times;    /* [F] seconds from the first frame, rising */
    const double* channels; /* [F, 61] */
} AvatarRecordingFacts;
AVATAR_API int avatar_recording_facts(const AvatarRecording* recording, AvatarRecordingFacts* out);
/* The frame at a time, linear between two frames; beyond the ends the frame at the end. Allocates nothing. */
AVATAR_API int avatar_recording_sample(AvatarRecording* recording, double seconds, AvatarFrame* frame);

/* ---- Cameras ------------------------------------------------------------------------------------------------------ */

/* A pinhole camera: +x right, +y down, +z forward, pixel centres at integers. */
typedef struct AvatarCamera {
    uint32_t struct_size AVATAR_SIZE(AvatarCamera);
    float camera_from_world[16];
    float clip_from_world[16]; /* y of clip space points down the image */
    float centre[3];           /* where the camera is, world */
    float tan_half_fov[2];     /* width / (2 fx), height / (2 fy) */
    int32_t width;             /* pixels */
    int32_t height;
} AvatarCamera;
/* These three return NULL, or a line that belongs to the library; then the camera stays as it is. Sides of an image are 1
 * to 32768 pixels. Any thread; they allocate nothing. */
/* Looks at a target [3] from a distance. yaw about +Y, positive towards +X, pitch upwards; the vertical field of view, more
 * than 0 and less than pi. */
AVATAR_API const char* avatar_camera_orbit(AvatarCamera* camera, const double* target, double distance, double yaw,
                                           double pitch, double fov_y, int32_t width, int32_t height);
/* x_camera = rotation [3, 3] x_world + translation [3]; x_pixel = K [3, 3] x_camera / z - 0.5. */
AVATAR_API const char* avatar_camera_opencv(AvatarCamera* camera, const double* rotation, const double* translation,
                                            const double* intrinsics, int32_t width, int32_t height);
/* The camera of an engine: view (camera from world) and projection [4, 4], as OpenGL has them: y up, looking along -z.
 * The projection's depth range does not matter. One that turns the image over or mirrors it is refused. */
AVATAR_API const char* avatar_camera_opengl(AvatarCamera* camera, const double* view, const double* projection,
                                            int32_t width, int32_t height);

/* ---- Frames ------------------------------------------------------------------------------------------------------- */

/* Stage joints: from the pose of an instance to pose floats and values of the frame. Fails for a pose that is not finite,
 * and for one whose floats are beyond float32. Allocates nothing. */
AVATAR_API int avatar_update_pose(AvatarInstance* instance);
/* The values of a camera: again for each camera that sees the same pose. Allocates nothing. */
AVATAR_API int avatar_update_camera(AvatarInstance* instance, const AvatarCamera* camera);
/* How tall the avatar stands in the image of a camera, as it is placed and posed now: the physical pixels that its
 * whole_size[1] covers, facing the camera. Infinite where it is not before the camera, and where avatar_update_pose or
 * avatar_update_camera refuse. */
AVATAR_API double avatar_height_px(const AvatarInstance* instance, const AvatarCamera* camera);
/* The content of buffer "Pose" after avatar_update_pose: weights [K], features [9 C], eyelid weights [L], skin matrices
 * [J, 3, 4]. `count` may be 0: then there is no buffer Pose. */
AVATAR_API const float* avatar_pose_floats(const AvatarInstance* instance, uint32_t* count);
/* Of each group [G, 3, 4]: mesh from binding mesh, and the rotation of its Gaussians with a last column of 0. */
AVATAR_API const float* avatar_group_matrix(const AvatarInstance* instance);
AVATAR_API const float* avatar_group_rotation(const AvatarInstance* instance);
/* Which buffer a binding of a kernel has. */
typedef struct AvatarBinding {
    uint32_t struct_size AVATAR_SIZE(AvatarBinding);
    const char* name;   /* the shader's */
    const char* buffer; /* of the pack or of the scene */
    uint32_t binding;   /* number in GLSL and MSL */
    int read_only;
    int32_t index;      /* of the pack's buffer; of avatar_sort_buffer for lists of a sort; -1: another avatar's buffer */
} AvatarBinding;
enum { AVATAR_UINT = 0, AVATAR_FLOAT = 1, AVATAR_FLOAT2 = 2, AVATAR_FLOAT3 = 3, AVATAR_FLOAT4 = 4 };
typedef struct AvatarConstant {
    uint32_t struct_size AVATAR_SIZE(AvatarConstant);
    const char* name; /* the shader's, for hosts that set constants by name */
    uint32_t type;    /* AVATAR_UINT .. AVATAR_FLOAT4 */
    uint32_t offset;  /* bytes from the beginning of the dispatch's block */
} AvatarConstant;
/* One dispatch of one kernel. */
typedef struct AvatarDispatch {
    uint32_t struct_size AVATAR_SIZE(AvatarDispatch);
    const char* entry; /* the kernel */
    const char* stage; /* "morph", "blend", "project", "sort", ... */
    uint32_t groups;   /* thread groups along x */
    uint32_t threads;  /* of each group, along x: what Metal wants at the dispatch; texts in GLSL hold it themselves */
    uint32_t binding_count;
    uint32_t constant_count;
    uint32_t block_binding; /* number of the uniform block in GLSL, of its buffer in MSL */
    uint32_t block_offset;  /* in avatar_passes_blocks; a multiple of AVATAR_BLOCK_ALIGN */
    uint32_t block_bytes;
} AvatarDispatch;
/* Mesh passes pose the rig's mesh, deform passes the Gaussians (both once a pose, in this order), view passes project
 * them (once a camera). A dispatch may read what an earlier one wrote. avatar_light.h has two more lists. */
enum { AVATAR_MESH = 0, AVATAR_DEFORM = 1, AVATAR_VIEW = 2 };
/* The passes of one list of a level (of AVATAR_MESH all levels have the same). NULL as avatar_load. */
AVATAR_API AvatarPasses* avatar_passes_open(const AvatarPack* pack, uint32_t level, uint32_t list,
                                            const AvatarAllocator* allocator);
/* Not those of avatar_sort_passes: the sort owns them. */
AVATAR_API void avatar_passes_close(AvatarPasses* passes);
AVATAR_API const char* avatar_passes_error(const AvatarPasses* passes);
AVATAR_API uint32_t avatar_passes_count(const AvatarPasses* passes);
AVATAR_API int avatar_dispatch(const AvatarPasses* passes, uint32_t index, AvatarDispatch* out);
AVATAR_API int avatar_binding(const AvatarPasses* passes, uint32_t dispatch, uint32_t index, AvatarBinding* out);
AVATAR_API int avatar_constant(const AvatarPasses* passes, uint32_t dispatch, uint32_t index, AvatarConstant* out);
/* The uniform blocks of all dispatches: ready bytes, little-endian, in the layout of the shader texts. */
AVATAR_API const void* avatar_passes_blocks(const AvatarPasses* passes, size_t* bytes);
/* Copies what the frame of an instance gives. Returns 1 where a value has changed, else 0: also for an instance of another
 * pack, with a line. Allocates nothing. */
AVATAR_API int avatar_passes_set(AvatarPasses* passes, const AvatarInstance* instance);
/* Call it when all dispatches of deform have run once: colours that no expression changes stay in their buffer, and
 * blend, whose work they mostly are, reads none of them. Returns 1 where a constant has changed. Allocates nothing. */
AVATAR_API int avatar_passes_keep_lasting(AvatarPasses* passes);

/* ---- Scenes ------------------------------------------------------------------------------------------------------- */

/* Splats of one chunk of one instance in a scene. `buffer` is what dispatches of the sort call its projected splats,
 * such as "0/Projected.0"; it is copied. */
typedef struct AvatarSceneChunk {
    uint32_t struct_size AVATAR_SIZE(AvatarSceneChunk);
    const char* buffer;
    uint32_t count;
} AvatarSceneChunk;
/* The sort of all splats of a scene (front to back), and the gather that writes the quads that draw them (back to
 * front). NULL as avatar_load; fails for more splats than one dispatch has. */
AVATAR_API AvatarSort* avatar_sort_open(const AvatarSceneChunk* chunks, uint32_t count, const AvatarAllocator* allocator);
AVATAR_API void avatar_sort_close(AvatarSort* sort);
AVATAR_API const char* avatar_sort_error(const AvatarSort* sort);
/* All splats: the instances to draw, four corners each. */
AVATAR_API uint32_t avatar_sort_count(const AvatarSort* sort);
/* Buffers "Pairs", "PairsOut", "Counts" and "Quads" of the scene, at least one element each. */
typedef struct AvatarSceneBuffer {
    uint32_t struct_size AVATAR_SIZE(AvatarSceneBuffer);
    const char* name;
    uint32_t stride; /* bytes of an element */
    uint32_t count;
} AvatarSceneBuffer;
AVATAR_API int avatar_sort_buffer(const AvatarSort* sort, uint32_t index, AvatarSceneBuffer* out);
/* The sort, then the gathers. No constant depends on the frame. They live as long as the sort. */
AVATAR_API const AvatarPasses* avatar_sort_passes(const AvatarSort* sort);
/* How many dispatches of them sort; those that follow gather. */
AVATAR_API uint32_t avatar_sort_dispatches(const AvatarSort* sort);

/* ---- Shaders ------------------------------------------------------------------------------------------------------ */

enum { AVATAR_GLSL430 = 0, AVATAR_GLSL310ES = 1, AVATAR_MSL = 2 };
/* The text of an entry, also of raster_vertex, raster_pixel, composite_vertex and composite_pixel, which draw. NULL:
 * there is none. Any thread. */
AVATAR_API const char* avatar_shader(uint32_t language, const char* entry);
/* Texts by index, with the entry's name in `entry`; NULL beyond the last. Any thread. */
AVATAR_API const char* avatar_shader_at(uint32_t language, uint32_t index, const char** entry);

#ifdef __cplusplus
}
#endif

#endif
