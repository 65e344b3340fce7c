#pragma once
#include <cstdio>
#include <string>
#include <vector>

/// Opens a file by a name in UTF-8, of any length; null where it cannot be opened.
std::FILE* open_file(const std::string& path, const char* mode);

/// The words of the command line, in UTF-8.
std::vector<std::string> words_of(int count, char** words);
