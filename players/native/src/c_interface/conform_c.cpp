// The functions of avatar_player.h that compare an engine with a reference.
#include <cstdio>

#include "../conform/gpu_stages.h"
#include "../formats/sized.h"

using namespace avatar;

struct AvatarReport : HandleBase {
    explicit AvatarReport(const AvatarAllocator& given) : HandleBase(given), rows(given, errors) {}

    Grown<AvatarReportRow> rows;
};

static const char* const player_profile = "engine";  // how players composite: quads

/// What a step gives. False where the error is set.
static bool outputs_of(const Avatar& avatar, GpuStages* stages, const Case& one, const Step& step, Arena& scratch,
                       Arrays& out) {
    Errors& errors = scratch.errors();
    bool fits = true;
    if (step.stage == "driving") {
        fits = run_driving(avatar, step, one.within_range, scratch, out);
    } else if (step.stage == "joints") {
        fits = run_joints(avatar, one, step, scratch, out);
    } else if (stages == nullptr) {
        errors.set("", "stage %s needs a GPU", Cut(step.stage, 40).data);
    } else {
        fits = stages->run(step, one, scratch, out);
        if (stages->failed) errors.set("", "stage %s: the engine's runner failed", Cut(step.stage, 40).data);
    }
    if (errors.any()) return false;
    if (fits) return true;
    char field[300];
    std::snprintf(field, sizeof(field), "case %s, stage %s", Cut(one.name, 80).data, Cut(step.stage, 40).data);
    errors.set(field, "its inputs do not fit this avatar; make the reference again with `pack --reference`");
    return false;
}

/// Runs every stage of the cases and adds a row for each output.
static void conform(AvatarReport& report, const Avatar& avatar, Span<Case> cases, GpuStages* stages) {
    Errors& errors = report.errors;
    for (const Case& one : cases) {
        for (const Step& step : one.steps) {
            if (step.profile.size > 0 && step.profile != player_profile) continue;
            Arena scratch(report.allocator, errors);
            Arrays out;
            if (!outputs_of(avatar, stages, one, step, scratch, out)) return;
            for (const Expected& output : step.outputs) {
                const Verdict v = judge(step, output, out);
                report.rows.add({sizeof(AvatarReportRow), one.name.data, step.stage.data, output.name.data, v.error, v.used, v.flips, v.passed});
            }
        }
    }
}

static void conform_with(AvatarReport& report, const AvatarPack& pack, Span<Case> cases, const AvatarStageRunner& runner) {
    Arena held(report.allocator, report.errors);
    GpuStages stages(runner, pack, held);
    if (stages.failed) report.errors.set("", "the engine's runner could not load the pack");
    else conform(report, pack.avatar, cases, &stages);
}

static bool is_whole(const AvatarStageRunner& runner) {
    return runner.load != nullptr && runner.write != nullptr && runner.read != nullptr && runner.run != nullptr && runner.draw != nullptr;
}

AvatarReport* avatar_conform(const AvatarPack* pack, const char* cases, size_t cases_bytes, const void* vectors,
                             size_t vectors_bytes, const AvatarStageRunner* runner, const AvatarAllocator* allocator) {
    AvatarReport* report = open_handle<AvatarReport>(allocator);
    if (report == nullptr) return nullptr;
    if (pack == nullptr || pack->unusable) report->errors.set("", "its pack could not be loaded");
    else if (cases == nullptr || cases_bytes > INT32_MAX) report->errors.set("cases", "is no text of up to 2147483647 bytes");
    else if (vectors == nullptr && vectors_bytes > 0) report->errors.set("vectors", "no bytes are given");
    AvatarStageRunner own = {};
    if (runner != nullptr && !take(runner, own)) report->errors.set("runner", not_sized);
    else if (runner != nullptr && !is_whole(own)) report->errors.set("runner", "a function of it is NULL");
    const Span<Case> read = report->errors.any() ? Span<Case>{}
                                                 : read_reference(Text(cases, cases_bytes),
                                                                  static_cast<const uint8_t*>(vectors), vectors_bytes,
                                                                  report->arena);
    if (!report->errors.any() && runner != nullptr) conform_with(*report, *pack, read, own);
    else if (!report->errors.any()) conform(*report, pack->avatar, read, nullptr);
    report->unusable = report->errors.any();
    return report;
}

void avatar_report_close(AvatarReport* report) { close_handle(report); }

const char* avatar_report_error(const AvatarReport* report) { return line_of(report); }

int avatar_report_passed(const AvatarReport* report) {
    if (report == nullptr || report->unusable) return 0;
    for (size_t i = 0; i < report->rows.size(); i++) {
        if (!report->rows[i].passed) return 0;
    }
    return report->rows.size() > 0;
}

int avatar_report_row(const AvatarReport* report, uint32_t index, AvatarReportRow* out) {
    return report == nullptr || index >= report->rows.size() ? refuse(out) : give(report->rows[index], out);
}
