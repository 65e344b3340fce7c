#pragma once
#include "avatar_conform.h"
#include "tools.h"

/// What the checker says of each program of programs.json: its field and its line.
int programs(const std::string& folder, Records& out);

/// Loads, poses and frames with an allocator that counts, and one that fails.
int memory(const std::string& folder, Records& out);

/// What the functions of the header make of NULL, of numbers that are not finite, and of what is not there: for each case
/// nothing, or what is wrong.
int refused(const std::string& folder, Records& out);

/// What each gzip file of a stream inflates to, each file after its length, and what is wrong with it.
int inflated(const std::string& folder, Records& out);
