# A protocol outside the tree of baudgate. Copy this folder, then:
#   cmake -B build && cmake --build build && BAUDGATE_MODULES=$PWD/build baudgate protocols example
cmake_minimum_required(VERSION 3.25)
project(baudgate_protocol_example LANGUAGES CXX)
find_package(baudgate REQUIRED)
file(GLOB sources protocols/example/*.cpp)
baudgate_protocol(example ${sources})
