#!/usr/bin/env python3
"""Writes man pages and shell completions from the programs' own --help, and from docs/keys.md.

usage: pages.py VERSION DATE OUT BAUDGATE [BAUDGATE_DDS]

Writes baudgate.1, baudgate.yaml.5, baudgate-dds.8 (with BAUDGATE_DDS) and baudgate.bash, _baudgate (zsh),
baudgate.fish into the folder OUT.
"""
# SPDX-License-Identifier: Apache-2.0
import dataclasses
import pathlib
import re
import subprocess
import sys

COLUMN = 30  # the column at which CLI11 begins a description
FILES = {"--config", "--pty", "--socket", "--security", "FILE", "DIR"}
LISTED = {"--profile": "profiles", "--protocol": "protocols"}


@dataclasses.dataclass
class Word:
    """An option (-c, --config TEXT) or a positional (LINE TEXT)."""

    names: list
    value: str  # '' for a flag
    required: bool
    repeats: bool
    help: str

    @property
    def completed_by(self):
        """'files', a subcommand that lists the values, or ''."""
        name = self.names[-1]
        return "files" if name in FILES else LISTED.get(name, "")


@dataclasses.dataclass
class Command:
    words: list  # ['certs', 'dds'] of `baudgate certs dds`
    help: str
    options: list
    positionals: list
    commands: list


def entries(text, heading):
    """(left column, description) of each line below a heading."""
    found = []
    inside = False
    for line in text.splitlines():
        if line and not line.startswith(" "):
            inside = line.strip() == heading
        elif inside and line.startswith(" " * COLUMN):
            found[-1] = (found[-1][0], line.strip())
        elif inside and line.strip():
            fits = line[COLUMN - 1 : COLUMN] in ("", " ")
            left, right = (line[:COLUMN], line[COLUMN:]) if fits else (line, "")
            found.append((left.strip(), right.strip()))
    return found


def word(left, description):
    names, _, rest = left.partition(" ")
    value = re.match(r"(TEXT|INT|UINT|FLOAT)\b", rest)
    default = re.search(r"=(\[?[^ \]]+\]?)", rest)
    if default:
        description = f"{description} (default: {default.group(1).strip('[]')})"
    kinds = {"TEXT": "TEXT", "FLOAT": "NUMBER", "INT": "NUMBER", "UINT": "NUMBER"}
    return Word(names.split(","), kinds[value.group(1)] if value else "", "REQUIRED" in rest, rest.endswith("..."),
                description)


def read(program, words=(), description=""):
    text = subprocess.run([program, *words, "--help"], check=True, capture_output=True, text=True).stdout
    options = [word(*entry) for entry in entries(text, "Options:")]
    positionals = [word(*entry) for entry in entries(text, "Positionals:")]
    commands = [read(program, [*words, name], help) for name, help in entries(text, "Subcommands:")]
    return Command(list(words), description, options, positionals, commands)


def leaves(command):
    for below in command.commands:
        yield from leaves(below) if below.commands else [below]


def every(command):
    yield command
    for below in command.commands:
        yield from every(below)


# Man pages


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text[:1] in (".", "'") else text


def roff_option(option):
    names = ", ".join(f"\\fB{roff(name)}\\fR" for name in option.names)
    value = f" \\fI{option.value}\\fR" if option.value else ""
    tail = "".join([" (required)" * option.required, " (may be repeated)" * option.repeats])
    return f".TP\n{names}{value}{tail}\n{roff(option.help) or 'See above.'}\n"


def roff_options(options):
    return "".join(roff_option(option) for option in options if "--help" not in option.names)


def roff_command(command):
    synopsis = f"\\fBbaudgate {roff(' '.join(command.words))}\\fR"
    for option in command.options:
        if option.required:
            synopsis += f" \\fB{roff(option.names[-1])}\\fR \\fI{option.value}\\fR"
    if any(not option.required and "--help" not in option.names for option in command.options):
        synopsis += " [\\fIoptions\\fR]"
    for place in command.positionals:
        name = f"\\fI{place.names[0]}\\fR"
        synopsis += f" {name}" if place.required else f" [{name}]"
    text = f".SS {synopsis}\n{roff(command.help)}.\n"
    for place in command.positionals:
        text += f".TP\n\\fI{place.names[0]}\\fR\n{roff(place.help)}\n"
    return text + roff_options(command.options)


def roff_keys(document):
    """The tables of docs/keys.md: a heading, and rows of key, default, allowed values and help."""
    text = ""
    for section in document.split("\n## ")[1:]:
        heading, *lines = section.replace("`", "").splitlines()
        text += f".SS {roff(heading)}\n"
        for line in [line for line in lines if line.startswith("| ")][2:]:
            key, default, allowed, help = (cell.strip() for cell in line[1:-1].split("|"))
            default = default if default.startswith("required") else default and f"default: {default}"
            facts = [help, allowed and f"allowed: {allowed}", default]
            text += f".TP\n\\fB{roff(key)}\\fR\n{roff('; '.join(fact for fact in facts if fact))}\n"
    return text


# Completions


def candidates(command):
    return [below.words[-1] for below in command.commands] + [n for option in command.options for n in option.names]


def listing(subcommand):
    column = {"profiles": 2}.get(subcommand, 1)
    return f"baudgate {subcommand} 2>/dev/null | awk 'NR > 1 {{ print ${column} }}'"


def bash(tree):
    text = ["# bash completion for baudgate(1); made from its --help", "_baudgate() {",
            '  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} command="" i',
            "  for ((i = 1; i < COMP_CWORD; i++)); do", '    case "$command ${COMP_WORDS[i]}" in']
    for command in every(tree):
        if command.words:
            above = " ".join(command.words[:-1])
            text.append(f'      "{above} {command.words[-1]}") command="{" ".join(command.words)}" ;;')
    text += ["    esac", "  done", '  COMPREPLY=()', '  case "$command $previous" in']
    for command in every(tree):
        name = " ".join(command.words)
        for option in command.options:
            if not option.value:
                continue
            pattern = "|".join(f'"{name} {each}"' for each in option.names)
            values = f'$(compgen -W "$({listing(option.completed_by)})" -- "$word")'
            values = {"files": '$(compgen -f -- "$word")', "": ""}.get(option.completed_by, values)
            text.append(f"    {pattern}) COMPREPLY=({values}); return ;;")
    text += ["  esac", '  case "$command" in']
    for command in every(tree):
        files = any(place.completed_by == "files" for place in command.positionals)
        words = " ".join(candidates(command))
        more = ' $(compgen -f -- "$word")' if files else ""
        text.append(f'    "{" ".join(command.words)}") COMPREPLY=($(compgen -W "{words}" -- "$word"){more}) ;;')
    return "\n".join(text + ["  esac", "}", "complete -o filenames -F _baudgate baudgate", ""])


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def zsh_action(each):
    if each.completed_by == "files":
        return "_files"
    if each.completed_by:
        return f"{{compadd -- $({listing(each.completed_by)})}}"
    return " "


def zsh_specs(command):
    specs = []
    for option in command.options:
        help = re.sub(r"([\[\]:\\])", r"\\\1", option.help)
        value = f":{option.value.lower()}:{zsh_action(option)}" if option.value else ""
        for name in option.names:
            specs.append(quoted(f"{'*' if option.repeats else ''}{name}[{help}]{value}"))
    for place in command.positionals:
        optional = "" if place.required else ":"
        help = re.sub(r"([:\\])", r"\\\1", place.help)
        specs.append(quoted(f":{optional}{help}:{zsh_action(place)}"))
    return specs


def zsh(tree):
    text = ["#compdef baudgate", "# zsh completion for baudgate(1); made from its --help", ""]
    for command in reversed(list(every(tree))):
        name = "_".join(["_baudgate", *command.words]).replace("-", "_")
        text.append(f"{name}() {{")
        specs = " \\\n    ".join(zsh_specs(command))
        if command.commands:
            text += ["  local curcontext=$curcontext state line", f"  _arguments -C {specs} \\",
                     "    '1:command:->command' '*::argument:->argument'", "  case $state in", "    command)",
                     "      local -a commands=("]
            text += [f"        {quoted(below.words[-1] + ':' + below.help.replace(':', chr(92) + ':'))}"
                     for below in command.commands]
            text += ["      )", "      _describe command commands ;;", "    argument)", "      case $line[1] in"]
            text += [f"        {below.words[-1]}) _{'_'.join(['baudgate', *below.words]).replace('-', '_')} ;;"
                     for below in command.commands]
            text += ["      esac ;;", "  esac"]
        else:
            text.append(f"  _arguments {specs}")
        text += ["}", ""]
    return "\n".join(text + ['_baudgate "$@"', ""])


def fish(tree):
    text = ["# fish completion for baudgate(1); made from its --help", "complete -c baudgate -f"]
    for command in every(tree):
        seen = [f"__fish_seen_subcommand_from {each}" for each in command.words]
        below = [each.words[-1] for each in command.commands]
        here = "; and ".join(seen + ([f"not __fish_seen_subcommand_from {' '.join(below)}"] if below else []))
        for each in command.commands:
            text.append(f"complete -c baudgate -n {quoted(here)} -a {each.words[-1]} -d {quoted(each.help)}")
        for option in command.options:
            line = f"complete -c baudgate -n {quoted(here)} -d {quoted(option.help)}"
            for name in option.names:
                line += f" -l {name[2:]}" if name.startswith("--") else f" -s {name[1:]}"
            if option.value:
                line += " -r -F" if option.completed_by == "files" else " -x"
            if option.completed_by not in ("", "files"):
                line += f" -a {quoted('(' + listing(option.completed_by) + ')')}"
            text.append(line)
        if any(place.completed_by == "files" for place in command.positionals):
            text.append(f"complete -c baudgate -n {quoted(here)} -F")
    return "\n".join(text + [""])


def main(version, date, out, baudgate, dds=None):
    here = pathlib.Path(__file__).parent
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)

    def page(name, **parts):
        text = (here / name).read_text(encoding="utf-8")
        for key, value in {"DATE": date, "VERSION": version, **parts}.items():
            text = text.replace(f"@{key}@", value.rstrip("\n"))
        (out / name.removesuffix(".in")).write_text(text, encoding="utf-8")

    tree = read(baudgate)
    page("baudgate.1.in", COMMANDS="".join(roff_command(command) for command in leaves(tree)))
    page("baudgate.yaml.5", KEYS=roff_keys((here.parent.parent / "docs/keys.md").read_text(encoding="utf-8")))
    if dds:
        page("baudgate-dds.8.in", OPTIONS=roff_options(read(dds).options))
    for name, made in {"baudgate.bash": bash, "_baudgate": zsh, "baudgate.fish": fish}.items():
        (out / name).write_text(made(tree), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) not in (5, 6):
        sys.exit(__doc__)
    main(*sys.argv[1:])
