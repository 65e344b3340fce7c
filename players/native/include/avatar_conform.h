/* Compares an engine that plays packs with a reference (`pack --reference`), stage by stage. Errors, arguments, memory and
 * structs are as in avatar_player.h. */
#ifndef AVATAR_CONFORM_H
#define AVATAR_CONFORM_H

#include "avatar_player.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct AvatarReport AvatarReport; /* what avatar_conform found */

/* What an engine does for avatar_conform: it holds the buffers of a pack and of a scene by their names, runs
 * dispatches, draws quads. Each function returns AVATAR_OK, or AVATAR_FAILED, which ends the run. Writable buffers
 * begin with zeros. */
typedef struct AvatarStageRunner {
    uint32_t struct_size AVATAR_SIZE(AvatarStageRunner);
    void* user;
    /* Makes the buffers of the pack, with their contents, and those of the scene: avatar_sort_buffer. */
    int (*load)(void* user, const AvatarPack* pack, const AvatarSort* scene);
    int (*write)(void* user, const char* buffer, const void* bytes, size_t size); /* from its beginning on */
    int (*read)(void* user, const char* buffer, void* bytes, size_t size);
    /* Runs one dispatch with its constants; the next call sees what it wrote. */
    int (*run)(void* user, const AvatarPasses* passes, uint32_t dispatch);
    /* Draws the quads of buffer "Quads" in their order into a float image of zeros: premultiplied colour and alpha,
     * each over what is there. Writes [height, width, 4], first row on top. */
    int (*draw)(void* user, uint32_t quads, int32_t width, int32_t height, float* rgba);
} AvatarStageRunner;

/* Runs every stage of a reference alone, from the reference's inputs, and compares: driving and joints here, all others
 * by the runner. `cases` is the text of cases.json or driving.json, `vectors` the .safetensors file beside it; the pack
 * is mini.avatar. `runner` may be NULL for a reference of driving. NULL as avatar_load. */
AVATAR_API AvatarReport* avatar_conform(const AvatarPack* pack, const char* cases, size_t cases_bytes, const void* vectors,
                                        size_t vectors_bytes, const AvatarStageRunner* runner,
                                        const AvatarAllocator* allocator);
AVATAR_API void avatar_report_close(AvatarReport* report);
AVATAR_API const char* avatar_report_error(const AvatarReport* report);
/* 1: all outputs passed, and there were any. */
AVATAR_API int avatar_report_passed(const AvatarReport* report);
typedef struct AvatarReportRow {
    uint32_t struct_size AVATAR_SIZE(AvatarReportRow);
    const char* name;   /* of the case */
    const char* stage;
    const char* output;
    double error;       /* largest absolute difference */
    double used;        /* largest share of the tolerance; 1 is the most that passes */
    uint32_t flips;     /* rows on the other side of a threshold */
    int passed;
} AvatarReportRow;
AVATAR_API int avatar_report_row(const AvatarReport* report, uint32_t index, AvatarReportRow* out);

#ifdef __cplusplus
}
#endif

#endif
