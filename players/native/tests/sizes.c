/* What a program sees that was compiled with other structs than the library. A test compiles this against the header, against
 * one whose structs end a field earlier, and against one whose structs have a field more, and links all three. Each struct
 * has a block of its own size, so that a sanitizer sees what is read or written beyond it. */
#include "avatar_conform.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef NEWER
#define ADDED(out) ((int)(out)->added)
#else
#define ADDED(out) 0
#endif

/* A struct that the library fills: what CALL returns, and some of its fields; then what it returns for sizes that are
 * none. */
#define FILLED(type, call, format, ...)                                          \
    do {                                                                         \
        type* out = (type*)sized(sizeof(type));                                  \
        int good = (call);                                                       \
        printf(#type " %d %d " format, good, ADDED(out), __VA_ARGS__);           \
        REFUSED(call);                                                           \
        free(out);                                                               \
    } while (0)
/* The same of a struct that the library reads. */
#define READ(type, out, call)                                                    \
    do {                                                                         \
        printf("read " #type);                                                \
        printf(" %d", (call));                                                   \
        REFUSED(call);                                                           \
        free(out);                                                               \
    } while (0)
#define REFUSED(call)                                                            \
    do {                                                                         \
        out->struct_size = 0;                                                    \
        printf(" %d", (call));                                                   \
        out->struct_size = 4097;                                                 \
        printf(" %d\n", (call));                                                 \
    } while (0)

static void* sized(size_t size) {
    const uint32_t said = (uint32_t)size;
    void* made = malloc(size);
    if (made == NULL) exit(1);
    memset(made, 0xA5, size);
    memcpy(made, &said, sizeof said);
    return made;
}

static void* zeroed(size_t size) {
    char* made = (char*)sized(size);
    memset(made + sizeof(uint32_t), 0, size - sizeof(uint32_t));
    return made;
}

static void* take(void* user, size_t bytes) { return (void)user, malloc(bytes); }
static void give(void* user, void* memory, size_t bytes) { (void)user, (void)bytes, free(memory); }

static int sort_of(const AvatarSceneChunk* chunks) {
    AvatarSort* sort = avatar_sort_open(chunks, 2, NULL);
    const int count = avatar_sort_error(sort) != NULL ? -1 : (int)avatar_sort_count(sort);
    avatar_sort_close(sort);
    return count;
}

static int load_with(const void* file, size_t bytes, const AvatarAllocator* allocator) {
    AvatarPack* pack = avatar_load(file, bytes, "a.avatar", allocator);
    const int good = pack != NULL && avatar_error(pack) == NULL;
    avatar_close(pack);
    return good;
}

/* 1: it is asked for its functions; 0: its size is refused. */
static int conform_with(const AvatarPack* pack, const AvatarStageRunner* runner) {
    AvatarReport* report = avatar_conform(pack, "{}", 2, "", 0, runner, NULL);
    const int asked = strstr(avatar_report_error(report), "a function of it is NULL") != NULL;
    avatar_report_close(report);
    return asked;
}

static void read_structs(const void* file, size_t bytes, const AvatarPack* pack, AvatarInstance* instance) {
    {
        AvatarAllocator* out = (AvatarAllocator*)zeroed(sizeof *out);
        out->allocate = take;
        out->release = give;
        READ(AvatarAllocator, out, load_with(file, bytes, out));
    }
    {
        AvatarFrame* out = (AvatarFrame*)zeroed(sizeof *out);
        out->weights[17] = 0.5f;
        avatar_enable_driving(instance, 1);
        READ(AvatarFrame, out, avatar_drive(instance, out));
    }
    {
        const double target[3] = {0, 0, 0};
        AvatarCamera* out = (AvatarCamera*)zeroed(sizeof *out);
        avatar_camera_orbit(out, target, 1, 0, 0, 0.8, 64, 48);
        READ(AvatarCamera, out, avatar_update_camera(instance, out));
    }
    {
        AvatarSceneChunk* out = (AvatarSceneChunk*)zeroed(2 * sizeof *out);
        for (int i = 0; i < 2; i++) {
            out[i].struct_size = sizeof *out;
            out[i].buffer = i == 0 ? "a" : "b";
#ifndef OLDER
            out[i].count = i == 0 ? 3 : 4;
#endif
        }
        READ(AvatarSceneChunk, out, sort_of(out));
    }
    {
        AvatarStageRunner* out = (AvatarStageRunner*)zeroed(sizeof *out);
        READ(AvatarStageRunner, out, conform_with(pack, out));
    }
}

#define SEES(name) \
    void name(const void* file, size_t bytes, const AvatarPack* pack, const AvatarRecording* take_of, const AvatarReport* report)
SEES(older);
SEES(same);
SEES(newer);

SEES(WHO) {
    const double target[3] = {0, 0, 0};
    AvatarInstance* instance = avatar_instance_open(pack, 0, NULL);
    AvatarPasses* view = avatar_passes_open(pack, 0, AVATAR_VIEW, NULL);
    AvatarSort* sort = avatar_sort_open(NULL, 0, NULL);
    FILLED(AvatarFacts, avatar_facts(pack, out), "%s %u", out->name, out->expressions);
    FILLED(AvatarGroup, avatar_group(pack, 0, out), "%s %u", out->name, out->count);
    FILLED(AvatarClip, avatar_clip(pack, 0, out), "%s %u", out->name, out->frames);
    FILLED(AvatarLevel, avatar_level(pack, 0, out), "%u %u", out->count, out->chunks);
    FILLED(AvatarChunk, avatar_chunk(pack, 0, 0, out), "%u %u", out->first, out->count);
    FILLED(AvatarBuffer, avatar_buffer(pack, 0, out), "%s %u", out->name, out->bytes);
    FILLED(AvatarDispatch, avatar_dispatch(view, 0, out), "%s %u", out->entry, out->groups);
    FILLED(AvatarBinding, avatar_binding(view, 0, 0, out), "%s %u", out->name, out->binding);
    FILLED(AvatarConstant, avatar_constant(view, 0, 0, out), "%s %u", out->name, out->type);
    FILLED(AvatarSceneBuffer, avatar_sort_buffer(sort, 3, out), "%s %u", out->name, out->stride);
    FILLED(AvatarRecordingFacts, avatar_recording_facts(take_of, out), "%u %g", out->frames, out->seconds);
    FILLED(AvatarFrame, avatar_recording_sample((AvatarRecording*)take_of, 0, out), "%g", (double)out->weights[17]);
    FILLED(AvatarReportRow, avatar_report_row(report, 0, out), "%s %s", out->name, out->stage);
    FILLED(AvatarCamera, avatar_camera_orbit(out, target, 1, 0, 0, 0.8, 64, 48) == NULL, "%g %d", (double)out->centre[2], out->width);
    read_structs(file, bytes, pack, instance);
    avatar_sort_close(sort);
    avatar_passes_close(view);
    avatar_instance_close(instance);
}

#ifdef MAIN
static void* read_file(const char* path, size_t* bytes) {
    FILE* file = fopen(path, "rb");
    if (file == NULL) exit(1);
    fseek(file, 0, SEEK_END);
    *bytes = (size_t)ftell(file);
    rewind(file);
    void* data = malloc(*bytes);
    if (data == NULL || fread(data, 1, *bytes, file) != *bytes) exit(1);
    fclose(file);
    return data;
}

/* PACK RECORDING CASES VECTORS: what each of the three sees. */
int main(int count, char** words) {
    void* files[4];
    size_t bytes[4];
    if (count != 5) return 2;
    for (int i = 0; i < 4; i++) files[i] = read_file(words[i + 1], &bytes[i]);
    AvatarPack* pack = avatar_load(files[0], bytes[0], "a.avatar", NULL);
    AvatarRecording* take_of = avatar_recording_open((const char*)files[1], bytes[1], "take.csv", NULL);
    AvatarReport* report = avatar_conform(pack, (const char*)files[2], bytes[2], files[3], bytes[3], NULL, NULL);
    older(files[0], bytes[0], pack, take_of, report);
    puts("same");
    same(files[0], bytes[0], pack, take_of, report);
    puts("newer");
    newer(files[0], bytes[0], pack, take_of, report);
    avatar_report_close(report);
    avatar_recording_close(take_of);
    avatar_close(pack);
    for (int i = 0; i < 4; i++) free(files[i]);
    return 0;
}
#endif
