#pragma once
#include "com.h"

namespace avatar {

/// A file of the HLSL texts.
struct HlslText {
    const char* name;
    const char* text;
};

/// All of them; the last row has no name. cmake/shader_texts.cmake writes the rows. Tests put others in their place.
extern const HlslText* hlsl_texts;

/// Microsoft's compiler, and what it has compiled.
class Compiler {
public:
    Compiler() = default;
    ~Compiler();
    Compiler(const Compiler&) = delete;
    Compiler& operator=(const Compiler&) = delete;

    /// Loads the DLL. Sets the error where there is none, or where another one has its name.
    bool load(Errors& errors);

    /// The bytecode of an entry of a file, which this holds; null with an error.
    ID3DBlob* compiled(Errors& errors, const char* file, const char* entry, const char* profile);

    /// What bytecode binds, which the caller releases; null with an error.
    ID3D11ShaderReflection* reflected(Errors& errors, const char* entry, ID3DBlob* code) const;

    char path[1024] = "";  // of the DLL

private:
    static constexpr uint32_t most = 32;

    struct Kept {
        const char* entry;
        ID3DBlob* code;
    };

    bool find_functions(Errors& errors);

    HMODULE module_ = nullptr;
    pD3DCompile compile_ = nullptr;
    HRESULT(WINAPI* reflect_)(LPCVOID, SIZE_T, REFIID, void**) = nullptr;
    Kept kept_[most] = {};
    uint32_t count_ = 0;
};

}  // namespace avatar
