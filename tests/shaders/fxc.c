/* Compiles many HLSL texts in one process: fxc LIBRARY LIST, where a row of LIST is `target entry file`. A warning is an
   error. Prints which file the library is; then for each row the result, who compiled it, and what the compiler said. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <windows.h>

#include <d3dcompiler.h>

enum { LONGEST = 1 << 20, PATH = 4096 };

static size_t read_file(const char *name, char *out) {
    FILE *file = fopen(name, "rb");
    size_t size = file ? fread(out, 1, LONGEST, file) : 0;
    if (file) fclose(file);
    return size;
}

/* The text in bytecode that names who compiled it. */
static const char *compiler_of(ID3DBlob *code) {
    const char *data = code->lpVtbl->GetBufferPointer(code);
    for (size_t at = 0, size = code->lpVtbl->GetBufferSize(code); at + 8 < size; at++) {
        if (memcmp(data + at, "Compiler", 8)) continue;
        while (at > 0 && data[at - 1] >= ' ') at--;
        return data + at;
    }
    return "";
}

int main(int argc, char **argv) {
    static char text[LONGEST], target[16], entry[64], name[PATH];
    HMODULE library = argc == 3 ? LoadLibraryA(argv[1]) : NULL;
    pD3DCompile compile = library ? (pD3DCompile)(void *)GetProcAddress(library, "D3DCompile") : NULL;
    FILE *list = compile ? fopen(argv[2], "r") : NULL;
    if (!list) return fprintf(stderr, "fxc: no library with D3DCompile, or no list (%lu)\n", GetLastError()), 2;
    GetModuleFileNameA(library, name, PATH);
    printf("%s\n", name);
    while (fscanf(list, "%15s %63s %4095[^\n]", target, entry, name) == 3) {
        ID3DBlob *code = NULL, *said = NULL;
        size_t size = read_file(name, text);
        HRESULT result = compile(text, size, name, NULL, NULL, entry, target, D3DCOMPILE_WARNINGS_ARE_ERRORS, 0, &code, &said);
        printf("\f%08lx\n%s\n", (unsigned long)result, code ? compiler_of(code) : "");
        if (said) printf("%s", (const char *)said->lpVtbl->GetBufferPointer(said)), said->lpVtbl->Release(said);
        if (code) code->lpVtbl->Release(code);
    }
    return 0;
}
