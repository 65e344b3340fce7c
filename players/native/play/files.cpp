#include "files.h"

#if !defined(_WIN32)

std::FILE* open_file(const std::string& path, const char* mode) { return std::fopen(path.c_str(), mode); }

std::vector<std::string> words_of(int count, char** words) { return std::vector<std::string>(words, words + count); }

#else

#define NOMINMAX
#include <windows.h>
#include <shellapi.h>

static std::wstring wide(const std::string& text) {
    const int size = MultiByteToWideChar(CP_UTF8, 0, text.data(), static_cast<int>(text.size()), nullptr, 0);
    std::wstring made(static_cast<size_t>(size), L'\0');
    MultiByteToWideChar(CP_UTF8, 0, text.data(), static_cast<int>(text.size()), made.data(), size);
    return made;
}

static std::string narrow(const wchar_t* text) {
    const int size = WideCharToMultiByte(CP_UTF8, 0, text, -1, nullptr, 0, nullptr, nullptr);
    std::string made(static_cast<size_t>(size > 0 ? size - 1 : 0), '\0');
    WideCharToMultiByte(CP_UTF8, 0, text, -1, made.data(), size, nullptr, nullptr);
    return made;
}

std::FILE* open_file(const std::string& path, const char* mode) {
    std::wstring name = wide(path);
    const DWORD size = GetFullPathNameW(name.c_str(), 0, nullptr, nullptr);
    if (size >= MAX_PATH) {  // such a name has to say that it is long
        std::wstring whole(size, L'\0');
        whole.resize(GetFullPathNameW(name.c_str(), size, whole.data(), nullptr));
        name = whole.compare(0, 2, L"\\\\") == 0 ? whole : L"\\\\?\\" + whole;
    }
    return _wfopen(name.c_str(), wide(mode).c_str());
}

std::vector<std::string> words_of(int, char**) {
    SetConsoleOutputCP(CP_UTF8);
    int count = 0;
    wchar_t** words = CommandLineToArgvW(GetCommandLineW(), &count);
    std::vector<std::string> made;
    for (int i = 0; i < count; i++) made.push_back(narrow(words[i]));
    LocalFree(words);
    return made;
}

#endif
