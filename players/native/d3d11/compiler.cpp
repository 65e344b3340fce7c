#include "compiler.h"

namespace avatar {

static const HlslText own_texts[] = {
#include "avatar_hlsl_texts.inc"
    {nullptr, nullptr},
};
const HlslText* hlsl_texts = own_texts;

static const char* const compiler_needed =
    "Microsoft's d3dcompiler_47.dll is needed: Windows 8.1 and later have it, and a program may have it beside itself";

static const HlslText* text_of(const char* name) {
    for (const HlslText* one = hlsl_texts; one->name != nullptr; one++) {
        if (std::strcmp(one->name, name) == 0) return one;
    }
    return nullptr;
}

namespace {

/// Gives the compiler the files that a text includes.
struct Includes final : ID3DInclude {
    HRESULT STDMETHODCALLTYPE Open(D3D_INCLUDE_TYPE, LPCSTR name, LPCVOID, LPCVOID* data, UINT* bytes) override {
        const HlslText* found = text_of(name);
        if (found == nullptr) return E_FAIL;
        *data = found->text;
        *bytes = static_cast<UINT>(std::strlen(found->text));
        return S_OK;
    }
    HRESULT STDMETHODCALLTYPE Close(LPCVOID) override { return S_OK; }
};

}  // namespace

static bool holds(const uint8_t* bytes, size_t size, const wchar_t* word) {
    const size_t length = wcslen(word) * sizeof(wchar_t);
    for (size_t at = 0; at + length <= size; at += sizeof(wchar_t)) {
        if (std::memcmp(bytes + at, word, length) == 0) return true;
    }
    return false;
}

/// Whether the version of a module names Microsoft, and not Wine, whose DLLs name both.
static bool is_microsofts(HMODULE module) {
    const HRSRC version = FindResourceW(module, MAKEINTRESOURCEW(1), MAKEINTRESOURCEW(16) /* RT_VERSION */);
    const HGLOBAL loaded = version == nullptr ? nullptr : LoadResource(module, version);
    const uint8_t* bytes = loaded == nullptr ? nullptr : static_cast<const uint8_t*>(LockResource(loaded));
    const size_t size = bytes == nullptr ? 0 : SizeofResource(module, version);
    return holds(bytes, size, L"Microsoft Corporation") && !holds(bytes, size, L"Wine");
}

Compiler::~Compiler() {
    for (uint32_t i = 0; i < count_; i++) drop(kept_[i].code);
    if (module_ != nullptr) FreeLibrary(module_);
}

bool Compiler::load(Errors& errors) {
    if (module_ != nullptr) return true;
    module_ = LoadLibraryExW(L"d3dcompiler_47.dll", nullptr, LOAD_LIBRARY_SEARCH_DEFAULT_DIRS);
    if (module_ == nullptr) {
        errors.set("Direct3D", "there is no compiler of shaders. %s", compiler_needed);
        return false;
    }
    wchar_t wide[512] = L"";
    GetModuleFileNameW(module_, wide, 511);
    WideCharToMultiByte(CP_UTF8, 0, wide, -1, path, sizeof path - 1, nullptr, nullptr);
    if (is_microsofts(module_)) return find_functions(errors);
    errors.set("Direct3D", "%s is not Microsoft's, but another compiler of that name. %s", Cut(path, 120).data, compiler_needed);
    FreeLibrary(module_);
    module_ = nullptr;
    return false;
}

bool Compiler::find_functions(Errors& errors) {
    const FARPROC compile = GetProcAddress(module_, "D3DCompile"), reflect = GetProcAddress(module_, "D3DReflect");
    compile_ = reinterpret_cast<pD3DCompile>(reinterpret_cast<void*>(compile));
    reflect_ = reinterpret_cast<decltype(reflect_)>(reinterpret_cast<void*>(reflect));
    if (compile_ == nullptr || reflect_ == nullptr) errors.set("Direct3D", "%s lacks functions. %s", Cut(path, 120).data, compiler_needed);
    return !errors.any();
}

/// The first line of what a compiler says.
static void take_line(const ID3DBlob* said_const, char* into, size_t size) {
    ID3DBlob* said = const_cast<ID3DBlob*>(said_const);
    const char* text = said == nullptr ? "it does not say why" : static_cast<const char*>(said->GetBufferPointer());
    size_t at = 0;
    for (; at + 1 < size && text[at] != 0 && text[at] != '\n' && text[at] != '\r'; at++) into[at] = text[at];
    into[at] = 0;
}

ID3DBlob* Compiler::compiled(Errors& errors, const char* file, const char* entry, const char* profile) {
    for (uint32_t i = 0; i < count_; i++) {
        if (std::strcmp(kept_[i].entry, entry) == 0) return kept_[i].code;
    }
    const HlslText* text = text_of(file);
    if (text == nullptr || count_ == most) {
        errors.set(entry, "is no shader of this library");
        return nullptr;
    }
    Includes includes;
    ID3DBlob *code = nullptr, *said = nullptr;
    const HRESULT result = compile_(text->text, std::strlen(text->text), text->name, nullptr, &includes, entry, profile,
                                    D3DCOMPILE_OPTIMIZATION_LEVEL3, 0, &code, &said);
    char line[400];
    take_line(said, line, sizeof line);
    drop(said);
    if (FAILED(result)) {
        errors.set(entry, "%s does not compile this shader: %s", Cut(path, 120).data, line);
        drop(code);
        return nullptr;
    }
    kept_[count_++] = {entry, code};
    return code;
}

ID3D11ShaderReflection* Compiler::reflected(Errors& errors, const char* entry, ID3DBlob* code) const {
    // IID_ID3D11ShaderReflection of this version of the compiler
    static const IID id = {0x8d536ca1, 0x0cca, 0x4956, {0xa8, 0x37, 0x78, 0x69, 0x63, 0x75, 0x55, 0x84}};
    void* made = nullptr;
    if (SUCCEEDED(reflect_(code->GetBufferPointer(), code->GetBufferSize(), id, &made))) {
        return static_cast<ID3D11ShaderReflection*>(made);
    }
    errors.set(entry, "%s does not say what this shader binds", Cut(path, 120).data);
    return nullptr;
}

}  // namespace avatar
