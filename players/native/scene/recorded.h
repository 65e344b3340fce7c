#pragma once
#include "device.h"

namespace avatar {

/// Finds the buffer of a binding; 0: there is none, and the error is set.
struct BufferFinder {
    Handle (*find)(void* user, const AvatarBinding& binding);
    void* user;
};

/// Makes a list ready to run. `passes` must outlive it; `arena` gives the memory. On an error, free what was made.
bool record(Device& device, const AvatarPasses* passes, BufferFinder finder, Arena& arena, RecordedList& into);

/// Whether a dispatch binds a buffer of that name.
bool binds(const RecordedList& list, Text buffer);

/// Runs all.
void run_all(Device& device, const RecordedList& list, const Clock& clock);

/// Frees what `record` made on the device, if anything.
void free_recorded(Device& device, RecordedList& list);

}  // namespace avatar
