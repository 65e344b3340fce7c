// Names that a program is made of: values of the frame, buffers of chunks.
#include <cstdio>

#include "read.h"

namespace avatar {

const FrameSource frame_sources[] = {
    {"world_row0", 4},  // world from avatar
    {"world_row1", 4},
    {"world_row2", 4},
    {"world_quat_wxyz", 4},
    {"group_matrix_row0", 4},  // by group: mesh from binding mesh
    {"group_matrix_row1", 4},
    {"group_matrix_row2", 4},
    {"group_rotation_row0", 4},
    {"group_rotation_row1", 4},
    {"group_rotation_row2", 4},
    {"camera_row0", 4},  // camera from world
    {"camera_row1", 4},
    {"camera_row2", 4},
    {"clip_row0", 4},  // clip from world
    {"clip_row1", 4},
    {"clip_row2", 4},
    {"clip_row3", 4},
    {"eye", 4},
    {"tan_half_fov", 2},
    {"image_size", 2},  // pixels
    {"light_ambient0", 4},  // of the scene: rgb
    {"light_ambient1", 4},
    {"light_ambient2", 4},
    {"light_ambient3", 4},
    {"light_ambient4", 4},
    {"light_ambient5", 4},
    {"light_ambient6", 4},
    {"light_ambient7", 4},
    {"light_ambient8", 4},
    {"light_place0", 4},  // of a light: towards it and 0, or its position and 1
    {"light_place1", 4},
    {"light_place2", 4},
    {"light_place3", 4},
    {"light_colour0", 4},
    {"light_colour1", 4},
    {"light_colour2", 4},
    {"light_colour3", 4},
    {"light_turn_row0", 4},  // frame that the light of the capture moves with from world
    {"light_turn_row1", 4},
    {"light_turn_row2", 4},
    {"shadow_row0", 4},  // column, row, distance and w of the shadow map, from world
    {"shadow_row1", 4},
    {"shadow_row2", 4},
    {"shadow_row3", 4},
    {"shadow_offset", 4},  // along the normal, along the light, 1 where there is a shadow map, 0
};

bool split_source(Text value, Text* name, int64_t* row) {
    uint32_t at = 0;
    while (at < value.size && (value.data[at] == '_' || (value.data[at] >= 'a' && value.data[at] <= 'z') ||
                               (value.data[at] >= '0' && value.data[at] <= '9'))) {
        at++;
    }
    *name = Text(value.data, at);
    *row = -1;
    if (at == 0 || at == value.size) return at > 0;
    if (value.data[at++] != '[') return false;
    const uint32_t begin = at;
    *row = 0;
    while (at < value.size && value.data[at] >= '0' && value.data[at] <= '9' && at - begin < 9) {
        *row = 10 * *row + (value.data[at++] - '0');
    }
    return at > begin && at + 1 == value.size && value.data[at] == ']';
}

ChunkName::ChunkName(const Level& level, const char* kind, uint32_t chunk) {
    size = level.prefix.size < sizeof(data) - 32 ? level.prefix.size : sizeof(data) - 32;
    if (size > 0) std::memcpy(data, level.prefix.data, size);
    size += static_cast<size_t>(std::snprintf(data + size, sizeof(data) - size, "%s.%u", kind, chunk));
}

int64_t chunk_index(const Level& level, Text kind, Text name) {
    const uint32_t begin = level.prefix.size + kind.size + 1;
    if (name.size <= begin || name.size > begin + 9) return -1;
    int64_t chunk = 0;
    for (uint32_t at = begin; at < name.size; at++) {
        if (name.data[at] < '0' || name.data[at] > '9') return -1;
        chunk = 10 * chunk + (name.data[at] - '0');
    }
    if (static_cast<size_t>(chunk) >= level.chunks.size) return -1;
    return name == Text(ChunkName(level, kind.data, static_cast<uint32_t>(chunk))) ? chunk : -1;
}

}  // namespace avatar
