"""The check of English: which comments and texts it finds in a file, which sentences it refuses, and when a number may change.

usage: prose_test.py [SOURCE]
"""
# SPDX-License-Identifier: Apache-2.0
import contextlib
import io
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(sys.argv.pop(1) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2]).resolve()
sys.path.insert(0, str(SOURCE / "packaging"))
import prose  # noqa: E402  pylint: disable=wrong-import-position,wrong-import-order


def sentences(path, text):
    """Line, kind and text of all sentences; * marks the first sentence of a comment."""
    return [(sentence.line, sentence.kind, "*" * sentence.opens + sentence.text) for paragraph in prose.paragraphs_of(path, text)
            if paragraph.kind != "string" for sentence in prose.sentences_of(paragraph)]


def rules(path, text, header=None):
    return [(finding.line, finding.rule) for finding in prose.findings_of(path, text, header)]


def comment(text):
    """The rules that a comment of one line breaks."""
    return [rule for _, rule in rules("a.h", f"// {text}\n")]


class ExtractionTest(unittest.TestCase):
    def test_lines_of_a_comment_are_joined_and_split_at_sentences(self):
        self.assertEqual(sentences("a.h", "int i;\n/// Returns the\n/// line. whose_reply.h has\n///\n/// the rest (e.g. bytes).\n"),
                         [(2, "comment", "*Returns the line."), (3, "comment", "whose_reply.h has"), (5, "comment", "the rest (e.g. bytes).")])

    def test_ends_of_sentences(self):
        self.assertEqual([text for _, _, text in sentences("a.md", "One … two. three (four.) Five, i.e. six? \"No. Yes.\" Seven 1.5 eight... nine! ten\n")],
                         ["One … two.", "three (four.)", "Five, i.e. six?", "\"No. Yes.\" Seven 1.5 eight... nine! ten"])

    def test_trailing_comments_stand_alone_unless_they_are_aligned(self):
        self.assertEqual(sentences("a.h", "int a;  ///< the first\nint b;  ///< the second,\n        ///< in ms\n// Text.\n"),
                         [(1, "comment", "*the first"), (2, "comment", "*the second, in ms"), (4, "comment", "*Text.")])

    def test_doc_comment_behind_a_plain_one_is_another(self):
        self.assertEqual(len([text for _, _, text in sentences("a.h", "// One line.\n/// Another line.\n") if text[0] == "*"]), 2)

    def test_literals_of_cpp_hide_slashes(self):
        self.assertEqual(sentences("a.cpp", 'f("// a", R"x(// b "// c)x", \'"\', 1\'000, \'\\\'\');  // Text.\ng(/*name*/ 1);\n'),
                         [(1, "comment", "*Text.")])

    def test_block_comment(self):
        self.assertEqual(sentences("a.js", "/* First line,\n * second line. */\n"), [(1, "comment", "*First line, second line.")])

    def test_literals_of_javascript_hide_slashes(self):
        self.assertEqual(sentences("a.js", "const a = /[/]\\/\"/; b = `// ${c}`; d = '//';  // Text.\n"), [(1, "comment", "*Text.")])

    def test_tables_diagrams_and_marks_for_tools_are_left_out(self):
        text = "// Text:\n//\n//   a    b\n//   of the table   c\n// What ends → 5\n// | of a row |\n// SPDX-License-Identifier: X\n}  // namespace a\n"
        self.assertEqual(sentences("a.h", text), [(1, "comment", "*Text:"), (5, "comment", "What ends → 5")])

    def test_separators_and_wide_quotations_are_no_tables(self):
        self.assertEqual(sentences("a.h", '// ---------------- The "S   S" form.\n'), [(1, "comment", '*The "S   S" form.')])

    def test_list_items_of_a_comment_are_paragraphs(self):
        self.assertEqual(sentences("a.h", "// Two parts:\n// - the first\n//   part\n// - the second\n"),
                         [(1, "comment", "*Two parts:"), (2, "comment", "the first part"), (4, "comment", "the second")])

    def test_docstrings_and_comments_of_python(self):
        text = '#!/usr/bin/env python3\n"""Does\na thing.\n\nusage: a.py\n"""\nA = """no text"""  # The text.\nB = "# none"\n'
        self.assertEqual(sentences("a.py", text), [(2, "comment", "*Does a thing."), (7, "comment", "*The text.")])

    def test_comments_of_shell(self):
        text = "#!/bin/sh\n# Text.\necho $# ${a#b} '# none' \"# none\"  # Behind.\ncat <<EOF\n# none\nEOF\n"
        expected = [(2, "comment", "*Text."), (3, "comment", "*Behind.")]
        self.assertEqual(sentences("a.sh", text), expected)
        self.assertEqual(sentences("packaging/rules", text), expected)
        self.assertIsNone(prose.paragraphs_of("LICENSE", "# Text."))

    def test_markdown(self):
        text = ("# Title\n\nSome **bold** [link](a.md#b)\ntext. `code. What` ends.\n\n```\nwhat\n```\n\n    indented code\n\n"
                "* An item\n  goes on\n* Another\n\n| head | b |\n| --- | --- |\n| `a | b` cell | c |\n")
        self.assertEqual(sentences("a.md", text),
                         [(1, "heading", "Title"), (3, "text", "Some bold link text."), (4, "text", "`code. What` ends."), (12, "text", "An item goes on"),
                          (14, "text", "Another"), (16, "heading", "head"), (16, "heading", "b"), (18, "cell", "`a | b` cell"), (18, "cell", "c")])


class RulesTest(unittest.TestCase):
    def test_start(self):
        for text in ["Of two replies the first is taken.", "Who may connect.", "whose readings are kept",
                     "What follows is text.", "Whatever comes.", "Where replies have no address, the line waits.",
                     "That is why.", "That the line is silent proves nothing.", "that wait", "Nothing that was asked.",
                     "Such a request waits.", "Neither has a name.", "of the line"]:
            self.assertEqual(comment(text), ["start"], text)
            if text[0].isupper():
                self.assertEqual(rules("a.md", f"Some text. {text}\n"), [(1, "start")], text)
        for text in ["Of course the line waits.", "What is a line?", "That device answers.", "Where possible, the line waits.",
                     "Nothing is sent.", "What to do.", "Neither a name nor a number.", "Neither `a` nor `b` is set.",
                     "The reply says what follows."]:
            self.assertEqual(comment(text), [], text)

    def test_start_is_not_looked_for_in_headings_and_small_letters_of_markdown(self):
        self.assertEqual(rules("a.md", "# What the tests catch\n\nWhat a line has:\n\n* of a line\n\n| what |\n| --- |\n| where the link is |\n"), [])

    def test_pronoun(self):
        for text in ["It waits.", "its first byte", "Their order.", "They wait.", "So a late reply counts.", "This is text.",
                     "Those of the profile.", "Both are open.", "One that waits.", "Others wait.", "Another is sent.",
                     "The same with a function.", "The next one within this time.", "A new one; the old line ends."]:
            self.assertEqual(comment(text), ["pronoun"], text)
        for text in ["One line per device.", "One of the lines.", "One or two bytes.", "Both ends of the cable.",
                     "This machine.", "These points are good.", "Another device answers.", "The same bytes.",
                     "The other end is open.", "So that the line waits.", "It is an error to wait.", "Other devices wait.",
                     "Waits. It never blocks.", "One for each line.", "It is unknown whether the line waits.",
                     "This many bytes."]:
            self.assertEqual(comment(text), [], text)
        self.assertEqual(rules("a.md", "It waits.\n"), [])

    def test_word(self):
        for text in ["A line can not wait.", "The file cannot be had.", "The line waits, lest it fails.",
                     "The line is closed for good.", "A request at hand.", "Says what becomes of the line.",
                     "The task ends without a word.", "The line begins anew.", "A client, whoever it is.",
                     "A reply of somebody else.", "Replies name nobody.", "A reply is owed.", "The line is told.",
                     "A request was heard.", "Modbus is spoken.", "The name stands there.", "A whole reply but for one byte.",
                     "The line waits on on."]:
            self.assertEqual(comment(text), ["word"], text)
        for text in ["The names can be told apart.", "The quality is 0xC0 for good values.", "`anew` is a key.",
                     'Prints "begins anew".', "Text as it stands.", "A sign may stand there.", "Returns Of of a line.",
                     "X stands for a digit.", "The gateway was told to stop.", "Not for reads but for writes."]:
            self.assertEqual(comment(text), [], text)

    def test_wrong_words_of_messages(self):
        self.assertEqual(rules("a.h", '// Text.\nf("a can not b", "begins anew", "What follows.");\n'), [(2, "word")])
        self.assertEqual(rules("a.js", "f('a can not b');\n"), [(1, "word")])
        self.assertEqual(rules("a.py", "f('a can not b')\n"), [])

    def test_long(self):
        self.assertEqual(comment("Word " * 45 + "."), [])
        self.assertEqual(comment("Word " * 46 + "."), ["long"])
        self.assertEqual(comment("Word " * 30 + ". " + "Word " * 30 + "."), [])

    def test_cell(self):
        table = "| head |\n| --- |\n| " + "word " * 25 + "{}|\n"
        self.assertEqual(rules("docs/a.md", table.format("")), [])
        self.assertEqual(rules("docs/a.md", table.format("word ")), [(3, "cell")])
        self.assertEqual(rules("README.md", table.format("word ")), [])

    def test_opening(self):
        spdx = "// SPDX-License-Identifier: Apache-2.0\n"
        self.assertEqual(rules("a.cpp", spdx), [(1, "opening")])
        self.assertEqual(rules("a.cpp", spdx, spdx), [(1, "opening")])
        self.assertEqual(rules("a.cpp", spdx, "// Lines.\n" + spdx), [])
        self.assertEqual(rules("a.cpp", "// Lines.\n" + spdx), [])
        self.assertEqual(rules("a.h", spdx), [])


class AllowedTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()  # pylint: disable=consider-using-with
        self.addCleanup(self.folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder.name)
        self.git("init", "-q")
        pathlib.Path("packaging").mkdir()
        self.write("a.h", 2)
        self.assertEqual(self.run_it("--write-allowed")[0], 0)
        self.commit()

    def git(self, *words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True, capture_output=True)

    def commit(self):
        self.git("add", ".")
        self.git("commit", "-qm", "text")

    def write(self, path, findings):
        pathlib.Path(path).write_text("int i;  // it waits\n" * findings, encoding="utf-8")
        self.git("add", path)

    def run_it(self, *words):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = prose.main(list(words))
        return code, out.getvalue()

    def numbers(self):
        return prose.parse_allowed(prose.ALLOWED.read_text(encoding="utf-8"))

    def test_the_number_must_be_right(self):
        self.assertEqual(self.run_it()[0], 0)
        self.write("a.h", 3)
        code, out = self.run_it()
        self.assertEqual(code, 1)
        self.assertIn("a.h: 3 findings of rule pronoun, 2 allowed\na.h:1: pronoun: ", out)
        self.write("a.h", 1)
        code, out = self.run_it()
        self.assertEqual(code, 1)
        self.assertIn("lower the number, packaging/prose.py --write-allowed", out)

    def test_a_number_becomes_smaller_but_not_higher(self):
        self.write("a.h", 1)
        self.assertEqual(self.run_it("--write-allowed")[0], 0)
        self.assertEqual(self.numbers(), {("a.h", "pronoun"): 1})
        self.write("a.h", 2)
        self.assertEqual(self.run_it("--write-allowed")[0], 1)
        self.assertEqual(self.numbers(), {("a.h", "pronoun"): 1})

    def test_a_file_without_findings_gets_none(self):
        self.write("a.h", 0)
        self.assertEqual(self.run_it("--write-allowed")[0], 0)
        self.assertEqual(self.numbers(), {})
        self.write("a.h", 1)
        self.assertEqual(self.run_it("--write-allowed")[0], 1)

    def test_new_and_removed_files(self):
        self.write("b.h", 3)
        self.git("rm", "-qf", "a.h")
        self.assertEqual(self.run_it("--write-allowed")[0], 0)
        self.assertEqual(self.numbers(), {("b.h", "pronoun"): 3})

    def test_marks_of_a_merge_conflict_are_skipped(self):
        text = prose.ALLOWED.read_text(encoding="utf-8")
        prose.ALLOWED.write_text(f"<<<<<<< HEAD\n{text}=======\na.h pronoun 1\n>>>>>>> b\n", encoding="utf-8")
        self.assertEqual(self.run_it("--write-allowed")[0], 0)
        self.assertEqual(prose.ALLOWED.read_text(encoding="utf-8"), text)

    def test_findings_of_a_path_are_listed(self):
        self.write("b.h", 1)
        code, out = self.run_it("b.h")
        self.assertEqual((code, out.splitlines()[-1]), (1, "prose: pronoun 1"))
        self.assertNotIn("a.h", out)


if __name__ == "__main__":
    unittest.main()
