// Each stage alone on a RenderingDevice of its own, against a reference.
#include "../../native/scene/stage_runner.h"
#include "core.h"
#include "gpu/rendering_device.h"

namespace godot {

static Value rows_of(const AvatarReport* report) {
    const Value rows = Value::array();
    AvatarReportRow row;
    for (uint32_t i = 0; avatar_report_row(report, i, &row) == AVATAR_OK; i++) {
        const Value made = Value::dictionary();
        made.set("name", row.name);
        made.set("stage", row.stage);
        made.set("output", row.output);
        made.set("error", row.error);
        made.set("used", row.used);
        made.set("flips", row.flips);
        made.set("passed", row.passed != 0);
        rows.append(made);
    }
    return rows;
}

static Value failed(const char* line) {
    const Value made = Value::dictionary();
    made.set("error", line);
    made.set("rows", Value::array());
    return made;
}

Value Core::conform(const Value& cases, const Value& vectors) {
    if (posed_ == nullptr) return failed("no avatar is loaded");
    const Value server = Value::object(singleton("RenderingServer"));
    const GDExtensionObjectPtr local = server.call("create_local_rendering_device").to_object();
    if (local == nullptr) return failed("this start of Godot has no RenderingDevice: use Forward+ or Mobile, and no --headless");
    const AvatarAllocator& allocator = counted_allocator();
    const size_t size = cases.to_utf8(nullptr, 0);
    char* const text = static_cast<char*>(allocator.allocate(nullptr, size + 1));
    if (text == nullptr) return failed("there is no memory");
    cases.to_utf8(text, size + 1);
    const Value result = failed("");
    {
        Errors errors;
        RdDevice device(local, true, allocator);
        avatar::StageRunner runner({device, errors, allocator});
        const AvatarStageRunner functions = runner.functions();
        const size_t held = vectors.size();
        AvatarReport* report = avatar_conform(posed_->pack, text, size, held == 0 ? nullptr : vectors.bytes_data(), held, &functions, &allocator);
        const char* line = errors.any() ? errors.line() : avatar_report_error(report);
        if (line != nullptr) result.set("error", line);
        result.set("rows", rows_of(report));
        avatar_report_close(report);
    }
    allocator.release(nullptr, text, size + 1);
    return result;
}

}  // namespace godot
