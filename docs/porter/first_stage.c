/* Stage `skin` of an avatar bundle in C99, checked against the bundle's own reference vectors.
 *
 *     cc -O2 -o first_stage first_stage.c && ./first_stage samples/trained/head_blendshapes posed
 *
 * For each vertex: posed = (sum_j weight_j skin_matrix_j) vertex + sum_l late_weight_l late_morph_l.
 * Needs a little-endian machine. The search for names below stands in for your JSON reader.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct { char *bytes; size_t size; } File;

static File read_file(const char *folder, const char *name) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *stream = fopen(path, "rb");
    if (!stream) { fprintf(stderr, "%s: cannot be read\n", path); exit(2); }
    fseek(stream, 0, SEEK_END);
    File file = { NULL, (size_t)ftell(stream) };
    rewind(stream);
    file.bytes = calloc(file.size + 1, 1);
    if (!file.bytes || fread(file.bytes, 1, file.size, stream) != file.size) exit(2);
    fclose(stream);
    return file;
}

/* safetensors: u64 length of a JSON header, the header, then the arrays. "NAME":{... "data_offsets":[BEGIN,END]}. */
static const void *tensor(File file, const char *name, size_t *count, size_t width) {
    uint64_t header;
    memcpy(&header, file.bytes, 8);
    char key[300];
    snprintf(key, sizeof key, "\"%s\":", name);
    char *at = strstr(file.bytes + 8, key), *offsets = at ? strstr(at, "\"data_offsets\":") : NULL;
    unsigned long long begin, end;
    if (!offsets || sscanf(offsets, "\"data_offsets\":[%llu,%llu]", &begin, &end) != 2) {
        fprintf(stderr, "no tensor %s\n", name);
        exit(2);
    }
    *count = (size_t)(end - begin) / width;
    return file.bytes + 8 + header + begin;
}

/* The tolerance that cases.json gives a tensor: "atol" of the object that names it. */
static double tolerance(File cases, const char *name) {
    char key[300];
    snprintf(key, sizeof key, "\"%s\"", name);
    for (char *at = strstr(cases.bytes, key); at; at = strstr(at + 1, key)) {
        char *end = strchr(at, '}'), *atol = strstr(at, "\"atol\":");
        if (atol && atol < end) return strtod(atol + 7, NULL);
    }
    fprintf(stderr, "no tolerance of %s\n", name);
    exit(2);
}

int main(int argc, char **argv) {
    if (argc != 3) { fprintf(stderr, "first_stage BUNDLE CASE\n"); return 2; }
    File rig = read_file(argv[1], "rig.safetensors");
    File golden = read_file(argv[1], "reference/vectors.safetensors");
    File cases = read_file(argv[1], "reference/cases.json");
    char name[256];
    size_t n, rows, count;
#define CASE(text) (snprintf(name, sizeof name, "%s/%s", argv[2], text), name)

    /* What moves every vertex of the mesh. Row i owns entries ptr[i] to ptr[i + 1]. */
    const uint32_t *skin_ptr = tensor(rig, "skin.row_ptr", &n, 4);
    const uint16_t *skin_joint = tensor(rig, "skin.column", &n, 2);
    const float *skin_weight = tensor(rig, "skin.weight", &n, 4);
    const uint32_t *late_ptr = tensor(rig, "late_morphs.row_ptr", &n, 4);
    const uint16_t *late_morph = tensor(rig, "late_morphs.column", &n, 2);
    const float *late_delta = tensor(rig, "late_morphs.position", &n, 4);

    /* What the stage is given, and what it has to give, for the rows that the reference kept. */
    const int64_t *vertex = tensor(golden, "vertices", &rows, 8);
    const float *in = tensor(golden, CASE("morph/vertices"), &n, 4);
    const float *matrix = tensor(golden, CASE("joints/skin_matrix"), &n, 4); /* [J, 4, 4], row-major */
    const float *late_weight = tensor(golden, CASE("pose/late_weights"), &n, 4);
    const float *want = tensor(golden, CASE("skin/posed_vertices"), &count, 4);
    double limit = tolerance(cases, CASE("skin/posed_vertices")), worst = 0;
    size_t bad = 0;

    for (size_t row = 0; row < rows; row++) {
        float sum[12] = { 0 };
        for (uint32_t e = skin_ptr[vertex[row]]; e < skin_ptr[vertex[row] + 1]; e++)
            for (int k = 0; k < 12; k++) sum[k] += skin_weight[e] * matrix[16 * skin_joint[e] + k];
        for (int axis = 0; axis < 3; axis++) {
            const float *m = sum + 4 * axis, *v = in + 3 * row;
            float posed = m[0] * v[0] + m[1] * v[1] + m[2] * v[2] + m[3];
            for (uint32_t e = late_ptr[vertex[row]]; e < late_ptr[vertex[row] + 1]; e++)
                posed += late_weight[late_morph[e]] * late_delta[3 * e + axis];
            double apart = fabs((double)posed - want[3 * row + axis]);
            if (apart > worst) worst = apart;
            bad += !(apart <= limit); /* true for a NaN, too */
        }
    }
    printf("skin, case %s: %zu vertices, %.2g m apart at most, %.2g allowed: %s\n", argv[2], rows, worst, limit,
           bad ? "WRONG" : "right");
    return bad ? 1 : 0;
}
