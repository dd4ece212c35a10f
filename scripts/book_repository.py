"""Preprocessor of the book (docs/book.toml): fits pages and links of the repository into it.

A page that is one line `{{#include FILE}}` becomes that file, its links counted from where the file lies. Links to files
that are not in docs/ become plain text with the file's path, since the book has no copy of them.
"""

import json
import os
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).resolve().parent.parent / "docs"
ROOT = DOCS.parent
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
INCLUDE = re.compile(r"\s*\{\{#include (\S+)\}\}\s*")


def chapters(items):
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            yield item["Chapter"]
            yield from chapters(item["Chapter"]["sub_items"])


def rewrite(text, source, page, pages):
    """`text` of the file `source`, to be shown as the chapter `page`; `pages` are the chapters of included files."""

    def link(match):
        image, label, target = match.groups()
        if re.match(r"[a-z]+:|#", target):
            return match[0]
        path, mark, anchor = target.partition("#")
        path = (source.parent / path).resolve()
        path = pages.get(path, path)
        if not path.is_relative_to(DOCS):
            name = path.relative_to(ROOT)
            return label if str(name) in label else f"{label} (`{name}`)"
        if path.name == "README.md":  # mdBook makes it the index of its folder.
            path = path.with_name("index.md")
        return f"{image}[{label}]({os.path.relpath(path, page.parent)}{mark}{anchor})"

    return LINK.sub(link, text)


def main():
    if sys.argv[1:2] == ["supports"]:
        return
    _, book = json.load(sys.stdin)
    found = [chapter for chapter in chapters(book["items"]) if chapter["path"]]
    sources = {}
    for chapter in found:
        page = DOCS / chapter["source_path"]
        include = INCLUDE.fullmatch(chapter["content"])
        sources[page] = (page.parent / include[1]).resolve() if include else page
    pages = {source: page for page, source in sources.items()}
    for chapter in found:
        page = DOCS / chapter["source_path"]
        source = sources[page]
        text = chapter["content"] if source == page else source.read_text()
        chapter["content"] = rewrite(text, source, page, pages)
    json.dump(book, sys.stdout)


main()
