#!/usr/bin/python3
"""Makes the documentation site: pages of docs/, reference pages that the program itself writes, the API by Doxygen; then Sphinx.
Usage: make_site.py DERAIL FOLDER: the program derail; the site comes into FOLDER/html. A warning or a dead link is an error."""

import html.parser
import os
import re
import shutil
import subprocess
import sys
import urllib.parse

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.realpath(__file__)), '..'))

DOXYGEN = """
PROJECT_NAME = train_derail
INPUT = "{root}/include/train_derail"
STRIP_FROM_INC_PATH = "{root}/include"
STRIP_FROM_PATH = "{root}/include"
OUTPUT_DIRECTORY = "{folder}"
RECURSIVE = YES
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
JAVADOC_AUTOBRIEF = YES
EXTRACT_ALL = YES
AUTOLINK_SUPPORT = NO
EXCLUDE_SYMBOLS = *::detail *::detail::*
HIDE_UNDOC_RELATIONS = YES
INPUT_FILTER = "sed -f {folder}/digits.sed"
QUIET = YES
WARN_IF_UNDOCUMENTED = NO
WARN_IF_INCOMPLETE_DOC = NO
WARN_AS_ERROR = FAIL_ON_WARNINGS
"""


def read(path):
    with open(path, encoding='utf-8') as f:
        return f.read()


def write(path, text):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, 'w', encoding='utf-8') as f:
        f.write(text)


def output(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, timeout=120).stdout


def keys_page(derail):
    page = ['# Keys of a scenario\n\nWritten by `derail keys`. How a file is made: [scenario files](../scenario_files.md).\n']
    group = None
    for entry in re.split(r'\n(?=\S)', output(derail, 'keys').strip()):
        key, *lines = entry.split('\n')
        lines = [line.strip() for line in lines if line.strip()]
        of_entry = re.split(r'[.[]', key)[0] if re.search(r'[.[]', key) else 'At the top'
        if of_entry != group:
            group = of_entry
            page.append(f'## {group}\n')
        told = '\n'.join(re.sub(r'^(allowed|default): (.*)', r': \1: `\2`', line) if re.match('(allowed|default): ', line) else f': {line}'
                         for line in lines)
        page.append(f'`{key}`\n{told}\n')
    return '\n'.join(page)


def subcommands(text):
    listed = re.split(r'\nSubcommands:\n', text)
    return re.findall(r'^  ([a-z]\w*) ', listed[1], re.M) if len(listed) > 1 else []


def command_page(derail):
    page = ['# Options of the command line\n\nWritten by `derail --help`. What they are for: [command line](../command_line.md).\n']

    def add(*words):
        text = output(derail, *words, '--help')
        page.append(f'{"#" * (2 + (len(words) > 1))} derail {" ".join(words)}\n\n```text\n{text.strip()}\n```\n'.replace(' \n', '\n', 1))
        for word in subcommands(text):
            add(*words, word)

    add()
    return '\n'.join(page)


def messages_page():
    page = ['# Messages, services, action\n\nAs they are declared in the package. Which topic has which: [topics](../topics.md).\n']
    for folder, title in (('msg', 'Messages'), ('srv', 'Services'), ('action', 'Action')):
        page.append(f'## {title}\n')
        for name in sorted(os.listdir(os.path.join(ROOT, folder))):
            page.append(f'### {name.split(".")[0]}\n\n```text\n{read(os.path.join(ROOT, folder, name)).strip()}\n```\n')
    return '\n'.join(page)


def api_pages(folder):
    """A page for each floor: what its headers are for, then what is in its namespace."""
    headers = os.path.join(ROOT, 'include', 'train_derail')
    floors = sorted(n for n in os.listdir(headers) if os.path.isdir(os.path.join(headers, n)))
    for floor in floors:
        page, spaces = [f'# {floor}\n\n## Headers\n'], set()
        for name in sorted(os.listdir(os.path.join(headers, floor))):
            text = read(os.path.join(headers, floor, name))
            told = re.search(r'((?:^///.*\n)+)#pragma once', text, re.M)
            told = re.sub(r'^/// ?(\\file)?', '', told.group(1), flags=re.M).strip() if told else ''
            page.append(f'### {floor}/{name}\n\n```text\n{told}\n```\n')
            spaces.update(re.findall(r'^namespace train_derail::(\w+) {', text, re.M))
        for space in sorted(spaces - {'detail'}):
            page.append(f'## Namespace {space}\n\n```{{doxygennamespace}} train_derail::{space}\n:content-only:\n:members:\n```\n')
        write(os.path.join(folder, floor + '.md'), '\n'.join(page))
    listed = '\n'.join(floors)
    write(os.path.join(folder, 'index.md'), '# The library, header by header\n\nWritten by Doxygen from `include/train_derail`. What each floor is for: '
          f'[architecture](../architecture.md).\n\n```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n')


def put_together(derail, source):
    """What Sphinx reads: the pages, with links that they share with the repository, and the pages that are written here."""
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(os.path.join(ROOT, 'docs'), source, ignore=shutil.ignore_patterns('__pycache__'))
    for name in ('config', 'CONTRIBUTING.md', 'CHANGELOG.rst'):
        beside = os.path.join(os.path.dirname(source), name)
        if not os.path.lexists(beside):
            os.symlink(os.path.join(ROOT, name), beside)
    shutil.copy(os.path.join(ROOT, 'package.xml'), source)
    text = read(os.path.join(ROOT, 'CONTRIBUTING.md'))
    write(os.path.join(source, 'contributing.md'), text.replace('](docs/', ']('))
    write(os.path.join(source, 'outcomes.md'), output(derail, 'fields'))
    write(os.path.join(source, 'reference', 'keys.md'), keys_page(derail))
    write(os.path.join(source, 'reference', 'options.md'), command_page(derail))
    write(os.path.join(source, 'reference', 'messages.md'), messages_page())
    api_pages(os.path.join(source, 'api'))
    doxygen = os.path.join(source, 'doxygen')
    # Doxygen and Sphinx part a number at the ' between its digits.
    write(os.path.join(doxygen, 'digits.sed'), "s/\\([0-9]\\)'\\([0-9]\\)/\\1\\2/g\n")
    subprocess.run(['doxygen', '-'], input=DOXYGEN.format(root=ROOT, folder=doxygen), text=True, check=True)


class Links(html.parser.HTMLParser):
    """What a page links to, and the places in it that can be linked to."""

    def __init__(self, path):
        super().__init__()
        self.links, self.places = [], set()
        self.feed(read(path))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.places.update(given[name] for name in ('id', 'name') if given.get(name))
        link = given.get('href') or given.get('src')
        if link and not re.match('[a-z]+:', link):
            self.links.append(urllib.parse.unquote(link))


def dead_links(folder):
    paths = [os.path.join(at, name) for at, _, names in os.walk(folder) for name in names if name.endswith('.html')]
    pages = {path: Links(path) for path in paths}
    dead = []
    for path, page in pages.items():
        for link in page.links:
            file, _, place = link.partition('#')
            file = file.split('?')[0]
            target = os.path.normpath(os.path.join(os.path.dirname(path), file)) if file else path
            if not os.path.exists(target) or (place and target in pages and place not in pages[target].places):
                dead.append(f'{os.path.relpath(path, folder)}: dead link: {link}')
    return dead


def main(arguments):
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    derail, folder = map(os.path.abspath, arguments)
    source, html_folder = os.path.join(folder, 'source'), os.path.join(folder, 'html')
    os.makedirs(folder, exist_ok=True)
    put_together(derail, source)
    status = subprocess.run(['/usr/bin/python3', '-m', 'sphinx', '-q', '-E', '-W', '--keep-going', '-b', 'html', '-d', os.path.join(folder, 'doctrees'), source,
                             html_folder],
                            check=False).returncode
    dead = dead_links(html_folder) if status == 0 else []
    for line in dead:
        print(line, file=sys.stderr)
    status = status or bool(dead)
    if status == 0:
        print(os.path.join(html_folder, 'index.html'))
    return status


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
