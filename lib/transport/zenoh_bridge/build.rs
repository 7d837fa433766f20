//! Generates the C++ side of the bridge and puts it into the static library.

fn main() {
    cxx_build::bridge("src/lib.rs")
        .include("../../..") // the root of the source tree, as for every C++ file of the project
        .std("c++17")
        .compile("zenoh_bridge_cxx");
    println!("cargo:rerun-if-changed=src/lib.rs");
    println!("cargo:rerun-if-changed=handlers.h");
}
