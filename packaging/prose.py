#!/usr/bin/env python3
"""Checks the English of comments and documents: CONTRIBUTING.md, section "How to write", has the rules.

usage: prose.py                    compares the tree with packaging/prose_allowed.txt; packaging/lint.sh runs this
       prose.py PATH…              lists all findings in these files and folders, and their number by rule
       prose.py --write-allowed    lowers the numbers in packaging/prose_allowed.txt to those of the tree

The check reads the files that git tracks in the repository of the current folder: comments of C++, C, JavaScript, Python and
shell, text and tables of Markdown. Code, code spans, quotations, tables and diagrams in comments are not checked.
String literals of C++ and JavaScript are searched for the few words that are wrong EVERYWHERE.
"""
# SPDX-License-Identifier: Apache-2.0
import bisect
import collections
import os
import pathlib
import re
import subprocess
import sys

ALLOWED = pathlib.Path("packaging/prose_allowed.txt")
MOST_WORDS = 45
MOST_WORDS_OF_A_CELL = 25

# --- Extraction: a file becomes paragraphs, a paragraph becomes sentences.

# kind: comment, text (a paragraph or list item of Markdown), heading, cell, string.
# opens: the paragraph is the first of its comment.
# lines: pairs of line number and text.
Paragraph = collections.namedtuple("Paragraph", "kind opens lines")
# plain: the text without the contents of code spans and quotations; both have the same length.
Sentence = collections.namedtuple("Sentence", "kind opens line text plain")
# A piece of a comment on one line. column: of its marker; trailing: code precedes the comment.
Piece = collections.namedtuple("Piece", "line column marker trailing text")

C_TOKEN = re.compile(r"""
    (?P<comment>//[^\n]*|/\*.*?\*/)
  | (?P<string>"(?:[^"\\\n]|\\.)*")
  | '(?:[^'\\\n]|\\.)+'
  | (?P<raw>R"(?P<end>[^()\\\s"]{0,16})\(.*?\)(?P=end)")
  | [0-9](?:'?[0-9A-Za-z_.])+""", re.DOTALL | re.VERBOSE)
JS_TOKEN = re.compile(r"""
    (?P<comment>//[^\n]*|/\*.*?\*/)
  | (?P<string>"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'|`(?:[^`\\]|\\.)*`)
  | (?<=[(,=:\[!&|?{};\n])[ ]*/(?![/*])(?:[^/\\\n\[]|\\.|\[(?:[^\]\\\n]|\\.)*\])+/""", re.DOTALL | re.VERBOSE)
PYTHON_TOKEN = re.compile(r"""
    (?P<comment>\#[^\n]*)
  | (?P<docstring>(?P<quote>\"{3}|'{3}).*?(?P=quote))
  | "(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'""", re.DOTALL | re.VERBOSE)
SHELL_TOKEN = re.compile(r"""
    (?<![^\s;(])(?P<comment>\#[^\n]*)
  | \\.
  | <<-?\s*['"]?(?P<end>\w+)['"]?[^\n]*\n.*?\n\s*(?P=end)(?=\n|$)
  | "(?:[^"\\]|\\.)*"|'[^']*'""", re.DOTALL | re.VERBOSE)
TOKENS = {".cpp": C_TOKEN, ".h": C_TOKEN, ".c": C_TOKEN, ".js": JS_TOKEN, ".py": PYTHON_TOKEN, ".sh": SHELL_TOKEN}

MARKER = re.compile(r"///<|//<|///|//!|//|#")
# Comments for tools, and the name behind the end of a namespace.
FOR_TOOLS = re.compile(r"SPDX-|clang-format |NOLINT|IWYU |namespace\b|shellcheck |pylint:|noqa|type: |eslint|!/|-\*-")
LIST_ITEM = re.compile(r"\s*(?:[-*+•]|\d{1,2}[.)])\s+(?=\S)")
SEPARATOR = re.compile(r"^ ?[-=]{3,} +")
PREFORMATTED = re.compile(r"\S(?: {2,}|\t+)\S|[│├└─┌┐┘┬┴┼═║▲▼►◄█▒]|^\s*(?:\||[-=~*#_/]{3,}|(?:usage|e\.g\.):|\$ )")
SPAN = re.compile(r"`[^`]*`")
QUOTATION = re.compile(r'"[^"]*"')


def pieces_of(text, token):
    """Yields the lines of all comments of a source, and its string literals as Piece with the marker `string`."""
    starts = [0] + [match.end() for match in re.finditer("\n", text)]
    code, token_end = "", 0  # the last piece of code, which tells docstrings from other strings
    for match in token.finditer(text):
        groups, found = match.groupdict(), match.group(0)
        code = text[token_end:match.start()].strip() or code
        token_end = match.end()
        row = bisect.bisect_right(starts, match.start())
        column = match.start() - starts[row - 1]
        trailing = bool(text[starts[row - 1]:match.start()].strip())
        if groups.get("comment"):
            if found.startswith("/*"):
                yield from block_comment(found, row, column, trailing)
            else:
                marker = MARKER.match(found).group(0)
                yield Piece(row, column, marker, trailing, found[len(marker):])
            continue
        if groups.get("docstring") and not trailing and (not code or code.endswith(":")):
            for number, line in enumerate(found[3:-3].split("\n")):
                yield Piece(row + number, column, "docstring", False, " " + (line[column:] if number else line))
        elif groups.get("string") or groups.get("raw"):
            yield Piece(row, column, "string", True, found)
        code = found


def block_comment(found, row, column, trailing):
    """The lines of a comment between /* and */; the name of an unused parameter is none."""
    if not re.search(r"\s", found[2:-2]):
        return
    for number, line in enumerate(found[2:-2].split("\n")):
        yield Piece(row + number, column, "/*", trailing and number == 0, re.sub(r"^\s*\*(?=\s|$)|^[*!]+", "", line))


def paragraphs_of_source(text, token):
    block = []
    for piece in pieces_of(text, token):
        if piece.marker == "string":
            yield Paragraph("string", False, [(piece.line, piece.text)])
            continue
        if block:
            last = block[-1]
            goes_on = piece.line == last.line + 1 and piece.column == last.column and not piece.trailing and \
                (piece.marker == last.marker or (last.trailing and piece.marker in last.marker))
            if not goes_on:
                yield from paragraphs_of_block(block)
                block = []
        if not FOR_TOOLS.match(piece.text.strip()):
            block.append(piece)
    if block:
        yield from paragraphs_of_block(block)


def paragraphs_of_block(block):
    """Splits a comment at empty lines and list items, and leaves out tables, diagrams and indented code."""
    opens, lines, in_list = True, [], False
    for piece in block:
        text = SEPARATOR.sub(" ", piece.text.expandtabs(4))
        indent = len(text) - len(text.lstrip())
        item = LIST_ITEM.match(text)
        preformatted = PREFORMATTED.search(QUOTATION.sub('""', text[item.end():] if item else text)) or (indent > 2 and not in_list and not item)
        if not text.strip() or item or preformatted:
            if lines:
                yield Paragraph("comment", opens, lines)
            opens, lines = opens and not lines and not preformatted, []
            in_list = bool(item) or (in_list and not text.strip())
        if text.strip() and not preformatted:
            lines.append((piece.line, text[item.end():] if item else text.strip()))
    if lines:
        yield Paragraph("comment", opens, lines)


def paragraphs_of_markdown(document):
    """Headings, paragraphs, list items and cells; the first row of a table counts as headings."""
    lines, fence, in_list, rows, after_blank = [], None, False, 0, True
    for number, line in enumerate(document.split("\n"), 1):
        stripped = line.strip()
        starts_fence = re.match(r"`{3,}|~{3,}", stripped)
        if fence or starts_fence:
            if starts_fence:
                fence = None if fence and stripped.startswith(fence) else fence or starts_fence.group(0)
            ends = True
        else:
            ends = not stripped or stripped[0] in "#|<" or LIST_ITEM.match(line)
        if ends and lines:
            yield Paragraph("text", False, lines)
            lines = []
        if fence or starts_fence:
            continue
        if not stripped:
            rows, after_blank = 0, True
            continue
        if stripped.startswith("|"):
            rows += 1
            if rows != 2:
                whole, position = stripped.strip("|"), 0
                for cell in re.split(r"(?<!\\)\|", hide(SPAN, re.compile(r"\|"), whole)):
                    text = without_marks(whole[position:position + len(cell)])
                    yield Paragraph("heading" if rows == 1 else "cell", False, [(number, text)])
                    position += len(cell) + 1
        elif stripped.startswith("#"):
            in_list = False
            yield Paragraph("heading", False, [(number, without_marks(stripped.lstrip("# ")))])
        elif not stripped.startswith("<"):
            item = LIST_ITEM.match(line)
            if item:
                in_list = True
            elif not line.startswith(" ") and after_blank:
                in_list = False
            if item or lines or in_list or not line.startswith("    "):
                lines.append((number, without_marks(line[item.end():] if item else stripped.lstrip("> "))))
        after_blank = False
    if lines:
        yield Paragraph("text", False, lines)


def without_marks(text):
    """Markdown without pictures, targets of links and marks of emphasis."""
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"\*\*|(?<!\w)\*(?=\S)|(?<=\S)\*(?!\w)", "", text).strip()


def hide(span, what, text):
    """Replaces the characters `what` by x within all that matches `span`, but not in its first and last character."""
    def masked(match):
        found = match.group(0)
        return found[0] + what.sub("x", found[1:-1]) + found[-1]
    return span.sub(masked, text)


BETWEEN = re.compile(r"(?<=[.!?…])([)\"'”]*)\s+(?=(\S))")
ABBREVIATION = re.compile(r"(?:^|[\s(])(?:e\.g|i\.e|etc|cf|vs|resp|approx|incl|excl|ca|no|fig|ch|chap|sec|min|max|p|pp|[A-Z])\.$", re.IGNORECASE)


def sentences_of(paragraph):
    """A sentence ends at a full stop; at ! ? and … only if no small letter follows."""
    starts, text = [], ""
    for number, line in paragraph.lines:
        starts.append((len(text), number))
        text += line.rstrip() + " "
    plain = hide(QUOTATION, re.compile(r"[^ ]"), hide(SPAN, re.compile(r"."), text))
    begin, opens = 0, paragraph.opens
    ends = []
    for match in BETWEEN.finditer(plain):
        full_stop = plain[match.start() - 1] == "." and not plain.endswith("...", 0, match.start())
        if (full_stop or not match.group(2).islower()) and not ABBREVIATION.search(plain, max(0, match.start() - 9), match.start()):
            ends.append(match.end())
    for end in ends + [len(plain)]:
        lead = len(plain[begin:end]) - len(plain[begin:end].lstrip(" ([*_"))
        if plain[begin + lead:end].strip():
            number = [number for offset, number in starts if offset <= begin + lead][-1]
            yield Sentence(paragraph.kind, opens, number, text[begin + lead:end].strip(), plain[begin + lead:end].strip())
            opens = False
        begin = end


# --- Rules: each has a name, and finds (advice) in a sentence.

Finding = collections.namedtuple("Finding", "path line rule advice text")

# Behind a pronoun these words, other than a noun, show that its own noun is missing.
NOT_NOUNS = """
    a about above after again against all also always among an and any are as at be because been before behind below
    beside between beyond but by came can cannot comes? could did do does each every ends follows? for from gets? gives?
    goes had happens? has have helps? here holds if in into is it its keeps lets? live made makes? many may means? might
    more must needs? never no none nor not now of on one ones only or outlives? over per returns? says? shall should shows
    since so some speaks? stays such takes? than that the then there they this those through to twice under until very
    waits was were what when where which while who whose will with within without works would wrote
""".split()
NO_NOUN = r"(?:[.,:;?!)]|$|\s*(?:[-–]\s|\b(?:" + "|".join(NOT_NOUNS) + r")\b))"
# Sentences begin with a capital. Only the first of a comment may begin with a small letter.
SUBJECT_FIRST = "begin with the subject, then the verb"
STARTS = [(re.compile(pattern), advice) for pattern, advice in [
    (r"Of\b(?! course\b)", f"Of …: {SUBJECT_FIRST}"),
    (r"(?:Who|Whose|Whom)\b(?!.*\?$)", f"Who …: {SUBJECT_FIRST}; a device is it"),
    (r"(?:What(?! to\b)|Whoever|Whatever|Whichever)\b(?!.*\?$)", f"a clause as subject: {SUBJECT_FIRST}"),
    (r"Where\b(?! (?:possible|needed|necessary|available|appropriate)\b)(?!.*\?$)", "Where …: the main clause first, then if or when"),
    (r"That(?: wait\b| return\b|" + NO_NOUN + ")", f"That …: {SUBJECT_FIRST}; name the noun"),
    (r"Nothing (?:that|of)\b", f"Nothing that …: {SUBJECT_FIRST}"),
    (r"Such\b", "Such …: name the noun and its property"),
    (r"Neither(?: [a-z]+s\b|" + NO_NOUN + r")(?!.*\bnor\b)", "Neither …: name the nouns"),
]]
PRONOUNS = [(re.compile(pattern), advice) for pattern, advice in [
    (r"It\b(?! is (?:an? |no |not )?(?:error|unknown|known|safe|possible|impossible|allowed|enough|undefined|up to)\b)", "It …: name the noun"),
    (r"(?:They|Its|Their|Them)\b", "a pronoun before its noun: name the noun"),
    (r"So\b(?! that\b)", "So …: say what follows from what"),
    (r"Others\b", "a pronoun without its noun: name the noun"),
    (r"(?:One|Both)(?! (?:of|to|or|and|more|in|by|over|ends|per|each|for each)\b)" + NO_NOUN, "a pronoun without its noun: name the noun"),
    (r"(?:This(?! many\b)|These|Those|Other|The others?|Another|The same)" + NO_NOUN, "a pronoun without its noun: name the noun"),
    (r"(?:A|The|Each|Every|Any|No)(?: (?:next|first|last|new|old|older|newer|other|latest|same|only))? ones?\b(?!-)", "one: name the noun"),
]]
# kinds: the kinds of sentences in which the word is looked for.
Word = collections.namedtuple("Word", "pattern advice kinds")
COMMENTS = {"comment"}
PROSE = {"comment", "text", "cell", "heading"}
EVERYWHERE = PROSE | {"string"}
WORDS = [Word(re.compile(pattern, re.IGNORECASE), advice, kinds) for pattern, advice, kinds in [
    (r"\bcan not\b", "cannot", EVERYWHERE),
    (r"\bbe had\b", "be found, be opened, be reached", EVERYWHERE),
    (r"\blest\b", "so that … not", EVERYWHERE),
    (r"\ba SPA\b", "an SPA", EVERYWHERE),
    (r"\binformations\b", "information", EVERYWHERE),
    (r"(?-i:\b(the|a|an|is|of|to|in|and|or|not|be|was|are|on|for|with|as|by) \1\b)", "the word once", PROSE),
    (r"\b(?:is|are|was|were|gone|off|closed|stopped|lost|ends?|ended) for good\b", "permanently", PROSE),
    (r"\bat hand\b", "available, already received", COMMENTS),
    (r"\bbec(?:omes?|ame|oming) of\b", "what happens to, the result of", PROSE),
    (r"\b(?:without|worth|enough for) a word\b", "without a message, without a reply", PROSE),
    (r"\banew\b(?!\()", "again, from the beginning; to restart", PROSE),
    (r"\bwhoever\b", "any client that, anybody who", COMMENTS),
    (r"\bsomebody else\b", "another master, another client, another program", COMMENTS),
    (r"\bnames? nobody\b", "has no address", PROSE),
    (r"\bow(?:e|es|ed)\b", "pending, outstanding", PROSE),
    (r"\b(?:is|are|was|were|be|been) told\b(?! (?:to|apart|that|which|how many)\b)", "is called, is notified, receives", PROSE),
    (r"\bheard\b(?! (?:of|from)\b)", "received", PROSE),
    (r"\bspoken\b", "used, transmitted", PROSE),
    (r"(?<!as it )(?<!as they )(?<!may )(?<!must )(?<!can )\b(?:stands?|stood)\b"
     r"(?! (?:for|out|by|alone|still|up|next to|in place of|between)\b)", "is, is written, is stored", PROSE),
    (r"\bsave for\b|^(?:(?!\bnot\b).)*\b(but for)\b", "except", PROSE),
    (r"\bfrom afar\b", "from another machine", PROSE),
    (r"(?<!::)\b(?:said|says?) of\b", "reported about", PROSE),
    (r"\b(?:simply|basically|note that)\b", "leave it out", PROSE),
]]


def capital(text):
    return text[:1].upper() + text[1:]


def check_sentence(sentence):
    """Yields (rule, advice) for all that is wrong with a sentence."""
    plain = sentence.plain
    for word in WORDS:
        found = sentence.kind in word.kinds and word.pattern.search(plain)
        if found:
            yield "word", f"{found.group(found.lastindex or 0)}: write {word.advice}"
    introduces = sentence.kind == "text" and plain.endswith(":")  # a table or a list, as a heading does
    if sentence.kind in ("string", "heading") or (introduces and plain.startswith(("What ", "Where "))):
        return
    start = next((advice for pattern, advice in STARTS if pattern.match(capital(plain) if sentence.opens else plain)), None)
    if start:
        yield "start", start
    elif sentence.opens:
        advice = next((advice for pattern, advice in PRONOUNS if pattern.match(capital(plain))), None)
        if advice:
            yield "pronoun", advice
    words = len(re.findall(r"\S*\w\S*", plain))
    if words > MOST_WORDS and sentence.kind != "cell":
        yield "long", f"{words} words, at most {MOST_WORDS}: split it"


def has_opening(text):
    return text.startswith(("//", "/*")) and not text.startswith("// SPDX")


def paragraphs_of(path, text):
    """None: the file has no prose that this check knows."""
    suffix = pathlib.PurePath(path).suffix
    if suffix == ".md":
        return paragraphs_of_markdown(text)
    if not suffix and re.match(r"#!.*sh\b", text):
        suffix = ".sh"
    return paragraphs_of_source(text, TOKENS[suffix]) if suffix in TOKENS else None


def findings_of(path, text, header=None):
    """All findings in a file. header: the text of the .h beside a .cpp, or None."""
    for paragraph in paragraphs_of(path, text) or []:
        if paragraph.kind == "string":
            sentences = [Sentence("string", False, paragraph.lines[0][0], paragraph.lines[0][1], paragraph.lines[0][1])]
            if not path.endswith((".cpp", ".h", ".js")):
                continue
        else:
            sentences = list(sentences_of(paragraph))
        for sentence in sentences:
            for rule, advice in check_sentence(sentence):
                yield Finding(path, sentence.line, rule, advice, sentence.text)
        words = sum(len(re.findall(r"\S*\w\S*", sentence.plain)) for sentence in sentences)
        if paragraph.kind == "cell" and path.startswith("docs/") and words > MOST_WORDS_OF_A_CELL:
            yield Finding(path, paragraph.lines[0][0], "cell", f"{words} words, at most {MOST_WORDS_OF_A_CELL}: move text below the table",
                          paragraph.lines[0][1])
    if path.endswith(".cpp") and not has_opening(text) and not has_opening(header or ""):
        yield Finding(path, 1, "opening", "say in the first line what the file does, here or in the header beside it", text.split("\n")[0])


# --- The tree and the list of what is allowed.

def git(*words, check_exit=True):
    return subprocess.run(["git", *words], capture_output=True, text=True, check=check_exit).stdout


def tracked(*paths):
    """The files of the index that exist, relative to the root of the repository."""
    return [path for path in git("ls-files", "-z", "--full-name", "--", *paths).split("\0") if path]


def read(path):
    """The text of a file; None: it is no text, or is deleted."""
    try:
        return pathlib.Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None


def findings_in(paths):
    for path in paths:
        suffix = pathlib.PurePath(path).suffix
        if suffix not in TOKENS and suffix not in (".md", "") or "/corpus/" in path:
            continue
        text = read(path)
        if text is not None:
            yield from findings_of(path, text, read(path[:-4] + ".h") if suffix == ".cpp" else None)


def counts(findings):
    return collections.Counter((finding.path, finding.rule) for finding in findings)


def parse_allowed(text):
    """The numbers by path and rule. Marks of a merge conflict are skipped; of two numbers the higher one is taken."""
    allowed = {}
    for line in text.splitlines():
        match = re.fullmatch(r"([^#<>=|\s]\S*) (\w+) (\d+)", line)
        if match:
            key = match.group(1), match.group(2)
            allowed[key] = max(allowed.get(key, 0), int(match.group(3)))
    return allowed


def format_allowed(numbers):
    head = ("# How many findings of packaging/prose.py a file may have, by rule. A number may only become smaller:\n"
            "# packaging/prose.py --write-allowed\n")
    return head + "".join(f"{path} {rule} {number}\n" for (path, rule), number in sorted(numbers.items()) if number)


def compare(found, allowed):
    """Returns the keys with more findings than allowed, and those with fewer."""
    keys = sorted(set(found) | set(allowed))
    return ([key for key in keys if found.get(key, 0) > allowed.get(key, 0)],
            [key for key in keys if found.get(key, 0) < allowed.get(key, 0)])


def known_files():
    """The files of the commit that changed the list last; None: no commit has a list. All other files are new."""
    merged = pathlib.Path(git("rev-parse", "--git-path", "MERGE_HEAD").strip()).exists()
    commit = git("log", "-1", "--format=%H", "HEAD", *["MERGE_HEAD"] * merged, "--", str(ALLOWED), check_exit=False).strip()
    return set(git("ls-tree", "-r", "-z", "--name-only", commit).split("\0")) if commit else None


def write_allowed(findings):
    """Returns the exit code. A number that would rise stays, unless its file is new."""
    found, allowed = counts(findings), parse_allowed(read(ALLOWED) or "")
    known = known_files()
    risen = [key for key in compare(found, allowed)[0] if known is not None and key[0] in known]
    for key in risen:
        report(findings, key, allowed.get(key, 0))
    ALLOWED.write_text(format_allowed({**found, **{key: allowed.get(key, 0) for key in risen}}), encoding="utf-8")
    print(f"prose: {sum(found.values())} findings in {len({path for path, _ in found})} files, {len(risen)} numbers may not rise")
    return 1 if risen else 0


def show(finding):
    print(f"{finding.path}:{finding.line}: {finding.rule}: {finding.advice}\n    {finding.text}")


def report(findings, key, most):
    mine = [finding for finding in findings if (finding.path, finding.rule) == key]
    print(f"{key[0]}: {len(mine)} findings of rule {key[1]}, {most} allowed")
    for finding in mine:
        show(finding)


def check(findings):
    found, allowed = counts(findings), parse_allowed(read(ALLOWED) or "")
    more, fewer = compare(found, allowed)
    for key in more:
        report(findings, key, allowed.get(key, 0))
    for path, rule in fewer:
        print(f"{path}: {found.get((path, rule), 0)} findings of rule {rule}, {allowed[path, rule]} allowed: lower the number, "
              "packaging/prose.py --write-allowed")
    if more or fewer:
        print("prose: CONTRIBUTING.md, section \"How to write\", has the rules")
        return 1
    print(f"prose: no finding beyond the {sum(allowed.values())} of {ALLOWED}")
    return 0


def main(words):
    if any(word.startswith("-") for word in words) and words != ["--write-allowed"]:
        sys.exit(__doc__)
    paths = [] if words == ["--write-allowed"] else words
    listed = tracked(*paths) if paths else []
    os.chdir(git("rev-parse", "--show-toplevel").strip())
    findings = list(findings_in(listed if paths else tracked()))
    if words == ["--write-allowed"]:
        return write_allowed(findings)
    if not paths:
        return check(findings)
    for finding in findings:
        show(finding)
    by_rule = sorted(collections.Counter(finding.rule for finding in findings).items())
    print("prose:", ", ".join(f"{rule} {number}" for rule, number in by_rule) or "no finding")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
