// Reads the program of a document.
#include "read.h"

namespace avatar {

static Constant read_constant(Json said, Arena& arena) {
    Constant made = {};
    made.name = arena.copy(said.key());
    if (said.is(JsonKind::text)) {
        made.kind = Constant::Kind::source;
        made.source = arena.copy(said.text());
    } else if (said.is(JsonKind::list)) {
        made.kind = Constant::Kind::vector;
        for (Json one : said.list(0, 4)) made.vector[made.floats++] = one.number();
    } else {
        made.number = said.number();
    }
    return made;
}

static Pass read_pass(Json said, Arena& arena) {
    Pass made = {};
    made.entry = arena.copy(said.at("entry").text());
    made.rows = said.at("rows").whole();
    const JsonList buffers = said.at("buffers").entries(), constants = said.at("constants").entries();
    made.buffers = arena.make<Bound>(buffers.size);
    made.constants = arena.make<Constant>(constants.size);
    if (arena.errors().any()) return {};
    size_t at = 0;
    for (Json one : buffers) {
        made.buffers[at].name = arena.copy(one.key());
        made.buffers[at++].buffer = arena.copy(one.text());
    }
    at = 0;
    for (Json one : constants) made.constants[at++] = read_constant(one, arena);
    return made;
}

static Span<Pass> read_passes(Json said, Arena& arena) {
    const JsonList listed = said.list();
    Span<Pass> made = arena.make<Pass>(listed.size);
    size_t at = 0;
    for (Json one : listed) {
        if (arena.errors().any()) return {};
        made[at++] = read_pass(one, arena);
    }
    return made;
}

static Level read_level(Json said, Arena& arena) {
    Level made = {};
    made.prefix = arena.copy(said.at("prefix").text());
    const JsonList chunks = said.at("chunks").list();
    made.chunks = arena.make<Run>(chunks.size);
    size_t at = 0;
    for (Json one : chunks) {
        const JsonList ends = one.list(2, 2);
        if (arena.errors().any()) return {};
        made.chunks[at++] = Run{ends[0].integer(), ends[1].integer()};
    }
    made.deform = read_passes(said.at("deform"), arena);
    made.view = read_passes(said.at("view"), arena);
    const Json shadow = said.at("shadow"), light = said.at("light");
    if (shadow.given()) made.shadow = read_passes(shadow, arena);
    if (light.given()) made.light = read_passes(light, arena);
    return made;
}

void read_program(Json said, Program& program, Arena& arena) {
    program.mesh = read_passes(said.at("mesh"), arena);
    const JsonList levels = said.at("levels").list();
    program.levels = arena.make<Level>(levels.size);
    size_t at = 0;
    for (Json one : levels) {
        if (arena.errors().any()) return;
        program.levels[at++] = read_level(one, arena);
    }
    const Json pose = said.at("pose");
    program.pose = {pose.at("weights").integer(), pose.at("features").integer(), pose.at("late").integer(),
                    pose.at("joints").integer()};
    program.pose_floats = said.at("pose_floats").integer();
    program.reads_mesh = said.at("reads_mesh").flag();
}

}  // namespace avatar
