// What the subcommands' options have in common.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace ringlet::app {

// What a subcommand does once its options are read; its result is the exit code.
using Job = std::function<int()>;

// SCENE and --set.
void add_scene(CLI::App& command, std::string& file, std::vector<std::string>& overrides);

// `groom` and all its subcommands.
void add_groom(CLI::App& app, Job& job);

}  // namespace ringlet::app
