"""Sphinx: the documentation as a site. ./run docs makes it; docs/make_site.py puts the pages together."""

import os
import re

HERE = os.path.dirname(os.path.abspath(__file__))

project = 'train_derail'
author = 'The train_derail developers'
copyright = author  # noqa: A001, Sphinx's name for it
with open(os.path.join(HERE, 'package.xml'), encoding='utf-8') as f:
    version = release = re.search('<version>(.*)</version>', f.read()).group(1)

extensions = ['breathe', 'myst_parser']
source_suffix = {'.md': 'markdown'}
myst_enable_extensions = ['deflist', 'colon_fence']
myst_heading_anchors = 4
smartquotes = False  # options begin with two dashes
nitpicky = True
# Names of other libraries, of templates and of what is no part of the face; C++ links them where they are documented here.
nitpick_ignore_regex = [('cpp:.*', '.*')]

breathe_projects = {'train_derail': os.path.join(HERE, 'doxygen', 'xml')}
breathe_default_project = 'train_derail'
breathe_default_members = ('members',)
breathe_show_include = False
# The same name in several places is no mistake in C++: overloads, and members that are declared in one header and used in others.
suppress_warnings = ['duplicate_declaration.cpp']

html_theme = 'furo'
html_title = f'train_derail {version}'
html_static_path = ['static']
html_css_files = ['site.css']
html_copy_source = False
html_show_sphinx = False
