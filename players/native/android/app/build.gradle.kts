plugins {
    id("com.android.application")
    id("org.jetbrains.kotlin.android")
}

android {
    namespace = "org.avatarexport.player"
    compileSdk = 35
    ndkVersion = "27.2.12479018"

    defaultConfig {
        applicationId = "org.avatarexport.player"
        minSdk = 26
        targetSdk = 35
        versionCode = 1
        versionName = "1.0" // of this app
        ndk { abiFilters += listOf("arm64-v8a", "x86_64") }
        // Devices with memory pages of 16 KB load only libraries that are aligned to them; NDK 27 needs the flag.
        externalNativeBuild {
            cmake { arguments += listOf("-DANDROID_STL=c++_static", "-DANDROID_SUPPORT_FLEXIBLE_PAGE_SIZES=ON") }
        }
    }

    externalNativeBuild {
        cmake {
            path = file("src/main/cpp/CMakeLists.txt")
            version = "3.22.1"
        }
    }

    compileOptions {
        sourceCompatibility = JavaVersion.VERSION_17
        targetCompatibility = JavaVersion.VERSION_17
    }
    kotlinOptions { jvmTarget = "17" }
    androidResources { noCompress += "avatar" } // a pack is compressed already
}
