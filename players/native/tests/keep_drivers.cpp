// Compiled into programs whose leaks a sanitizer reports: drivers stay loaded to the end, so that the report names them.
extern "C" int dlclose(void*) { return 0; }
